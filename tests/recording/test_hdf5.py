"""HDF5 recordings: round trips, and every finding about a file that cannot be used."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from friction_ocp.errors import FrictionOcpError
from friction_ocp.recording import hdf5
from friction_ocp.recording.hdf5 import read_recording, write_recording
from friction_ocp.recording.import_recording import inspect_file
from friction_ocp.recording.recording import Channel, Recording

Edit = Callable[[Any], None]


def write(path: Path, edit: Edit = lambda file: None) -> Path:
    """Write a sound recording by hand, then spoil it."""
    with h5py.File(path, "w") as file:
        file.attrs["format"] = "friction-ocp-recording/1"
        file["time"] = np.arange(5) * 0.1
        file["channels/position"] = np.arange(5.0)
        file["channels/position"].attrs["unit"] = "deg"
        edit(file)
    return path


def replace(path: str, values: Any, **attributes: str) -> Edit:
    def edit(file: Any) -> None:
        if path in file:
            del file[path]
        file[path] = values
        file[path].attrs.update(attributes)

    return edit


def messages(path: Path) -> str:
    with pytest.raises(FrictionOcpError) as caught:
        read_recording(path)
    assert all(str(finding).startswith(str(path)) for finding in caught.value.findings)
    return str(caught.value)


def same(one: Recording, other: Recording) -> bool:
    channels = zip(one.channels.values(), other.channels.values(), strict=True)
    return (
        all(
            (a.name, a.unit, a.clock) == (b.name, b.unit, b.clock)
            and np.array_equal(a.time, b.time)
            and np.array_equal(a.values, b.values, equal_nan=True)
            for a, b in channels
        )
        and (one.title, one.source, one.licence) == (other.title, other.source, other.licence)
        and dict(one.attributes) == dict(other.attributes)
    )


text = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
numbers = st.floats(-1e300, 1e300) | st.just(np.nan)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    clocks = {
        clock: np.cumsum(draw(hnp.arrays(float, st.integers(2, 8), elements=st.floats(1e-4, 10.0))))
        for clock in ("time", "encoder")
    }
    names = st.text("abcXYZ._-0 äµ", min_size=1, max_size=8).filter(lambda name: name != ".")
    channels: dict[str, Channel] = {}
    for name in draw(st.lists(names, min_size=1, max_size=4, unique=True)):
        clock = draw(st.sampled_from(sorted(clocks)))
        values = draw(hnp.arrays(float, len(clocks[clock]), elements=numbers).filter(lambda v: not np.isnan(v).all()))
        channels[name] = Channel(
            name, clocks[clock], values, draw(st.sampled_from(["rad", "A", "N m", "degC", "1"])), clock
        )
    reserved = ("format", "title", "source", "licence")
    attributes = draw(st.dictionaries(text.filter(lambda key: bool(key) and key not in reserved), text, max_size=3))
    return Recording("x", channels, draw(text), draw(text), draw(text), attributes=attributes)


@settings(max_examples=40, deadline=None)
@given(recordings())
def test_recording_survives_writing_and_reading(recording: Recording) -> None:
    """What was written is read: channels in their order, clocks, units, NaN, provenance, attributes."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.h5"
        write_recording(recording, path)
        found = read_recording(path)
        assert same(recording, found)
        assert list(found.channels) == list(recording.channels)
        assert found.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
        assert (found.name, found.path) == ("x", path)
        assert [entry.name for entry in Path(folder).iterdir()] == ["x.h5"]


def test_units_become_si(tmp_path: Path) -> None:
    """Channels in other units, counts with a scale, and time in ms are read in SI units."""

    def edit(file: Any) -> None:
        file["time"].attrs["unit"] = "ms"
        replace("channels/encoder", np.array([0, 1024, 2048, 0, 0], dtype="i4"), unit="counts", scale="2*pi/4096 rad")(
            file
        )
        replace("channels/enable", np.array([True, False, True, True, True]), unit="1")(file)

    recording = read_recording(write(tmp_path / "a.h5", edit))
    np.testing.assert_allclose(recording.channels["position"].values, np.deg2rad(np.arange(5)))
    np.testing.assert_allclose(recording.channels["encoder"].values, [0, np.pi / 2, np.pi, 0, 0])
    np.testing.assert_allclose(recording.channels["encoder"].time, np.arange(5) * 1e-4)
    assert [channel.unit for channel in recording.channels.values()] == ["1", "rad", "rad"]
    assert recording.channels["enable"].values.tolist() == [1, 0, 1, 1, 1]


@pytest.mark.parametrize("value", [[b"deg"], np.array([["deg"]], dtype="S3"), np.array(["deg"], dtype=object)])
def test_units_in_arrays_of_one_element_are_read(tmp_path: Path, value: Any) -> None:
    """Other programs store an attribute as an array; its only element counts."""

    def edit(file: Any) -> None:
        file["channels/position"].attrs["unit"] = value

    path = write(tmp_path / "a.h5", edit)
    with h5py.File(path) as file:
        stored: Any = file["channels/position"]
        expected = np.deg2rad(stored[()])
    np.testing.assert_allclose(read_recording(path).channels["position"].values, expected)
    assert next(row for row in inspect_file(path).splitlines() if "channels.position" in row).split()[2] == "deg"


def test_channel_on_its_own_clock_needs_no_common_time(tmp_path: Path) -> None:
    """A channel with a clock has its samples there; /time is needed only by channels without one."""

    def edit(file: Any) -> None:
        del file["time"]
        file["clocks/slow"] = np.array([0.0, 1.0])
        replace("channels/position", np.array([1.0, 2.0]), unit="rad", clock="/clocks/slow")(file)

    channel = read_recording(write(tmp_path / "a.h5", edit)).channels["position"]
    assert (channel.clock, channel.time.tolist(), channel.values.tolist()) == ("slow", [0.0, 1.0], [1.0, 2.0])


def test_links_inside_the_file_are_followed(tmp_path: Path) -> None:
    """A soft link to data of the same file is as good as the data."""

    def edit(file: Any) -> None:
        file["raw/a"] = np.arange(5.0)
        file["raw/a"].attrs["unit"] = "A"
        file["channels/current"] = h5py.SoftLink("/raw/a")
        file["channels/again"] = h5py.SoftLink("current")

    channels = read_recording(write(tmp_path / "a.h5", edit)).channels
    assert channels["current"].values.tolist() == channels["again"].values.tolist() == [0, 1, 2, 3, 4]


def link_out(target: str) -> Edit:
    def edit(file: Any) -> None:
        file["out"] = h5py.ExternalLink("other.h5", "/")
        file["channels/bad"] = h5py.ExternalLink("other.h5", "/x") if target == "external" else h5py.SoftLink(target)

    return edit


def virtual(file: Any) -> None:
    layout = h5py.VirtualLayout(shape=(5,), dtype="f8")
    layout[:] = h5py.VirtualSource("other.h5", "x", shape=(5,))
    file.create_virtual_dataset("channels/bad", layout)


def huge(file: Any) -> None:
    file.create_dataset("channels/bad", shape=(300_000_000,), dtype="f8", chunks=(1_000_000,))


FINDINGS: list[tuple[Edit, str]] = [
    (lambda file: file.attrs.pop("format"), ": there is no attribute format; 'friction-ocp-recording/1' is read here"),
    (
        lambda file: file.attrs.update(format="friction-ocp-static/1"),
        ": attribute format is 'friction-ocp-static/1'; 'friction-ocp-recording/1' is read here",
    ),
    (lambda file: file.pop("time"), ": there is no /time"),
    (lambda file: file.pop("channels"), ": there are no channels; at least one under /channels"),
    (
        replace("time", [0.0, 12.0301, 12.03, 13.0, 14.0]),
        ": time is not increasing at sample 2 (12.0300 s after 12.0301 s); fix or split the recording",
    ),
    (replace("time", [0.0, 1.0, 1.0, 2.0, 2.0]), "at sample 2 (1.0000 s after 1.0000 s), and at 1 more; fix or split"),
    (
        replace("time", [0.0, 1.00000002, 1.00000001, 2.0, 3.0]),
        "time is not increasing at sample 2 (1.00000001 s after 1.00000002 s)",
    ),
    (replace("time", [0.0, np.nan, 2.0, 3.0, 4.0]), ": time is not finite at sample 1 (1 of 5 samples); remove these"),
    (replace("time", np.array([0.0])), ": time has 1 sample; at least 2 are needed"),
    (replace("time", np.arange(5.0), unit="deg"), ": time is in rad; a unit of time, such as s or ms"),
    (replace("time", np.array([b"a", b"b"])), ": time is not numeric but |S1; real numbers"),
    (
        replace("channels/position", np.arange(4.0), unit="rad"),
        ": channel 'position' has 4 samples, but time has 5; one value per time, NaN where a sample is missing",
    ),
    (replace("channels/position", np.arange(5.0)), ": channel 'position' has no unit; an attribute unit such as rad"),
    (
        replace("channels/position", np.arange(5.0), unit="parsec"),
        ": channel 'position': unknown unit 'parsec'; accepted:",
    ),
    (replace("channels/position", np.arange(5.0), unit="counts"), ": channel 'position': unit 'counts' has no scale"),
    (
        replace("channels/position", np.full(5, np.nan), unit="rad"),
        ": channel 'position' has no value: all 5 samples are NaN; remove the channel",
    ),
    (
        replace("channels/position", [0.0, np.inf, 1.0, 2.0, -np.inf], unit="rad"),
        ": channel 'position' is infinite at sample 1 (2 of 5 samples); write NaN",
    ),
    (
        replace("channels/position", np.ones(5, dtype="c16"), unit="rad"),
        ": channel 'position' is not numeric but complex128",
    ),
    (replace("channels/position", np.ones((5, 2)), unit="rad"), ": channel 'position' has the shape (5, 2); one value"),
    (replace("channels/group/x", np.ones(5), unit="rad"), ": channel 'group' is not a dataset"),
    (replace("channels", np.ones(5)), ": /channels is not a group"),
    (
        replace("channels/position", np.ones(5), unit="rad", clock="/elsewhere/c"),
        ": channel 'position' has the clock '/elsewhere/c'; /clocks/<name>",
    ),
    (replace("channels/position", np.ones(5), unit="rad", clock="/clocks/c"), ": there is no /clocks/c"),
    (
        link_out("external"),
        ": /channels/bad is a link out of the file or in a circle; data inside the file; copy it there",
    ),
    (link_out("/out/x"), ": /out/x is a link out of the file"),
    (link_out("/channels/bad"), ": /channels/bad is a link out of the file or in a circle"),
    (link_out("/nowhere"), ": there is no /channels/bad"),
    (virtual, ": channel 'bad' keeps its data in other files"),
    (huge, ": channel 'bad' declares 300000000 samples; at most 50000000; split the recording"),
]


@pytest.mark.parametrize(("edit", "message"), FINDINGS)
def test_each_fault_is_told(tmp_path: Path, edit: Edit, message: str) -> None:
    """Every fault of a file is told in words that name the place, the fault and the way out."""
    assert message in messages(write(tmp_path / "a.h5", edit))


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    """One reading tells everything that is wrong."""

    def edit(file: Any) -> None:
        file.attrs["format"] = "x"
        replace("time", [0.0, 1.0, 1.0, 2.0, 3.0])(file)
        replace("channels/a", np.arange(3.0), unit="A")(file)
        replace("channels/b", np.arange(5.0), unit="?")(file)

    found = messages(write(tmp_path / "a.h5", edit)).splitlines()
    assert len(found) == 4


def test_missing_foreign_and_damaged_files_are_told(tmp_path: Path) -> None:
    """A path without a file, a file of another kind and a truncated one are told apart."""
    assert "there is no such file; correct the path" in messages(tmp_path / "no.h5")
    other = tmp_path / "a.csv"
    other.write_text("time,x\n0,1\n")
    assert "this is not an HDF5 file; a file of format friction-ocp-recording/1; friction-ocp import" in messages(other)
    whole = write(tmp_path / "a.h5").read_bytes()
    (tmp_path / "cut.h5").write_bytes(whole[: len(whole) // 2])
    assert "the file cannot be opened" in messages(tmp_path / "cut.h5")


def test_damaged_data_is_told(tmp_path: Path) -> None:
    """A dataset whose compressed bytes are damaged is a finding, not a crash."""
    path = tmp_path / "a.h5"

    def edit(file: Any) -> None:
        values = np.random.default_rng(0).normal(size=5)
        file.create_dataset("channels/z", data=values, compression="gzip", fletcher32=True).attrs["unit"] = "A"

    write(path, edit)
    with h5py.File(path, "r") as file:
        chunk: Any = file["channels/z"]
        offset = chunk.id.get_chunk_info(0).byte_offset
    content = bytearray(path.read_bytes())
    content[offset + 10 : offset + 20] = bytes(10)
    path.write_bytes(content)
    assert "channel 'z' cannot be read" in messages(path)


TIME = np.array([0.0, 1.0, 2.0])
VALUES = np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("channels", "attributes", "message"),
    [
        ({}, {}, "there are no channels"),
        ({"a/b": Channel("a/b", TIME, VALUES, "A")}, {}, "'a/b' cannot be a name; text without a slash; rename it"),
        ({"a": Channel("a", TIME, VALUES, "")}, {}, "channel 'a': unknown unit ''"),
        ({"a": Channel("a", TIME, VALUES[:2], "A")}, {}, "channel 'a' has 2 samples, but time has 3"),
        ({"a": Channel("a", TIME, VALUES, "A")}, {"title": "x"}, "attribute 'title' has a place of its own; rename it"),
        (
            {"a": Channel("a", TIME, VALUES, "A"), "b": Channel("b", TIME + 1.0, VALUES, "A")},
            {},
            "channel 'b' has another time axis than the other channels of clock 'time'; one time axis per clock; give",
        ),
    ],
)
def test_what_could_not_be_read_is_not_written(
    tmp_path: Path, channels: dict[str, Channel], attributes: dict[str, str], message: str
) -> None:
    """Writing refuses what reading would refuse, and leaves no file."""
    with pytest.raises(FrictionOcpError) as caught:
        write_recording(Recording("x", channels, attributes=attributes), tmp_path / "x.h5")
    assert message in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_failed_writing_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A write that breaks half way leaves the earlier file whole and nothing beside it."""
    path = write(tmp_path / "x.h5")
    before = path.read_bytes()

    def fail(*arguments: Any) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(hdf5, "_write_dataset", fail)
    with pytest.raises(OSError, match="disk full"):
        write_recording(Recording("x", {"a": Channel("a", TIME, VALUES, "A")}), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_same_recording_gives_same_bytes(tmp_path: Path) -> None:
    """Files carry no date: writing twice gives one fingerprint."""
    recording = Recording("x", {"a": Channel("a", TIME, VALUES, "A")})
    write_recording(recording, tmp_path / "a.h5")
    write_recording(recording, tmp_path / "b.h5")
    assert (tmp_path / "a.h5").read_bytes() == (tmp_path / "b.h5").read_bytes()
