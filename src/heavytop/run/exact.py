"""The base class of runs, `Run`, and the run that integrates nothing: the exact motion."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np

from heavytop.analytic.form import Record
from heavytop.analytic.motion import MOST_DIGITS, Motion
from heavytop.exact.decimals import context
from heavytop.files import write_text
from heavytop.run.plan import Plan, exact_span, span
from heavytop.scene.arguments import path_of
from heavytop.scene.quantities import QUANTITIES, Need, need_of, values_of
from heavytop.scene.scene import Scene

if TYPE_CHECKING:
    import pandas
    import xarray

END_SPARE_DIGITS: Final = 20  # beyond the scene's: enough to tell whether an event is at the end


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """The motion of a scene over its span, at its sample times.

    Attributes
    ----------
    scene : Scene
    motion : Motion
        The exact motion of the scene.
    plan : Plan
    source : str
        ``integrated`` or ``closed form``.
    """

    scene: Scene
    motion: Motion
    plan: Plan
    source: ClassVar[str]
    samples: ClassVar[Any]  # of each kind its own property

    if not TYPE_CHECKING:  # else no wrong name would be seen

        def __getattr__(self, name: str) -> Any:
            """Any other quantity at the sample times: rates, `omega`, `reaction` [N]."""
            if name not in QUANTITIES:
                return self.__getattribute__(name)  # which says that there is no such thing
            return values_of(self.samples, name, self.motion)

    def to_xarray(self) -> xarray.Dataset:
        """Return samples and events as an xarray Dataset that holds the scene itself."""
        from heavytop.run.trajectory_file import dataset

        return dataset(self)

    def to_pandas(self, *, events: bool = False) -> pandas.DataFrame:
        """Return the samples as a pandas DataFrame with the times [s] as index.

        Columns are named as in `to_xarray`, those of vectors ``axis_x`` and so on; ``attrs`` has
        their units.

        Parameters
        ----------
        events : bool
            Whether the events instead, a row for each, with its ``kind``.

        Examples
        --------
        >>> import heavytop as ht
        >>> table = ht.propagate(ht.load_scene("sicm-kicked")).to_pandas()
        >>> print(table.index.name, table.theta[0.0], table.attrs["units"]["theta"])
        t 0.1 rad
        """
        from heavytop.run.trajectory_file import frame

        return frame(self.to_xarray(), "event" if events else "t")

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the trajectory to a netCDF file, or its samples to one that ends in ``.csv``.

        Parameters
        ----------
        path : path
            The file, written whole or not at all; one that is there is replaced.

        Raises
        ------
        OSError
            It cannot be written.
        """
        from heavytop.run.trajectory_file import write

        place = path_of("path", path)
        if place.suffix.lower() == ".csv":
            write_text(place, self.to_pandas().to_csv())
        else:
            write(self, place)


@dataclass(frozen=True, eq=False)
class SceneMotion(Run):
    """The exact motion of a scene, from its start to its end; its plan integrates nothing."""

    source: ClassVar[str] = "closed form"

    @property
    def moves(self) -> bool:
        """Whether the scene wants more than its class and its period."""
        return need_of(self.scene.quantities) is not Need.NOTHING

    @property
    def span(self) -> float:
        """The end time of the scene, as a double [s]."""
        return span(self.scene, self.motion)

    @cached_property
    def digits(self) -> int:
        """Decimal digits that leave φ and ψ, less their whole turns, with those of the scene."""
        rate = self.motion.rate
        turned = (1 + abs(self.span) * rate) * (1 + rate)
        spare = END_SPARE_DIGITS + math.ceil(math.log10(turned))
        return min(self.scene.digits + spare, MOST_DIGITS)

    @cached_property
    def end(self) -> Any:
        """The motion at the end, which is exact: a `Record`."""
        end = exact_span(self.scene, self.motion, context(self.digits))
        return self.motion.at(end, self.digits)

    @cached_property
    def samples(self) -> Record:
        """The motion at the sample times of the scene, which are doubles."""
        found: Record = self.motion.at(np.linspace(0.0, self.span, self.scene.samples))
        return found

    @property
    def counts(self) -> dict[str, Any]:
        """The number of events of each kind that the scene asks for."""
        from heavytop.run.counts import count_exactly

        return count_exactly(self.motion, self.end.t, self.scene.events)
