"""What is installed here, found without importing any of it."""

import pytest

from heavytop import doctor


def test_the_document_says_where_compiled_equations_are_and_how_large(monkeypatch, tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "cache.db").write_bytes(b"12345")
    monkeypatch.setenv("HEYOKA_CACHE_DIR", str(tmp_path))
    assert doctor.diagnosis()["cache"] == {"folder": str(tmp_path), "exists": True, "bytes": 5}
    monkeypatch.setenv("HEYOKA_CACHE_DIR", str(tmp_path / "none"))
    assert doctor.cache() == {"folder": str(tmp_path / "none"), "exists": False, "bytes": 0}


def test_an_extra_that_is_missing_has_the_line_that_installs_it(monkeypatch):
    needed = doctor.requirements()
    assert "heyoka" in needed[""]
    assert "numba" in needed["rivals"]
    assert "numba" not in needed[""]
    monkeypatch.setattr(doctor, "version", lambda name: None)
    pip = "pip install '.[rivals]'"
    found = doctor.diagnosis()
    assert found["optional"]["rivals"] == {"missing": needed["rivals"], "install": pip}
    assert f"missing: {pip}" in doctor.in_words(found)


NEEDED = {"linux": ["numpy", "heyoka"], "darwin": ["numpy"], "win32": ["numpy"]}


@pytest.mark.parametrize("system", NEEDED)
def test_what_pip_leaves_out_on_a_system_is_not_missing_there(system, monkeypatch):
    lines = ["numpy<3,>=2", "heyoka<8,>=7.10; sys_platform == 'linux'", "x; extra == 'film'"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: lines)
    monkeypatch.setattr("sys.platform", system)
    assert doctor.requirements() == {"": NEEDED[system], "film": ["x"]}
