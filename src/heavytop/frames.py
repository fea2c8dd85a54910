"""An xarray Dataset as a pandas DataFrame, which keeps the units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas
    import xarray


def frame(dataset: xarray.Dataset, *over: str) -> pandas.DataFrame:
    """Return as columns what lies over some dimensions, in their order: these are the index.

    Of a vector each component is a column, such as ``axis_x``. The attributes have ``units`` and
    ``long_name`` by column, and what the Dataset has.

    Examples
    --------
    >>> import xarray
    >>> axis = ("t", "space"), [[0.0, 1.0]], {"units": "1"}
    >>> found = frame(xarray.Dataset({"axis": axis}, {"t": [2.0], "space": ["x", "y"]}), "t")
    >>> found.loc[2.0].to_dict(), found.attrs
    ({'axis_x': 0.0, 'axis_y': 1.0}, {'units': {'axis_x': '1', 'axis_y': '1'}, 'long_name': {}})
    """
    columns: dict[str, Any] = {}
    for name, values in dataset.data_vars.items():
        if values.dims == over:
            columns[f"{name}"] = values
        elif values.dims[:-1] == over:
            [*_, apart] = values.dims
            for k, part in enumerate(dataset[apart].values):
                columns[f"{name}_{part}"] = values.isel({apart: k}, drop=True)
    table = type(dataset)(columns).to_dataframe(dim_order=over)
    columns |= {name: dataset[name] for name in over}
    told = {
        key: {name: x.attrs[key] for name, x in columns.items() if key in x.attrs}
        for key in ("units", "long_name")
    }
    table.attrs = dict(dataset.attrs) | told
    return table
