import pickle

import numpy as np
import pandas
import polars
import pyarrow
import pytest

import imkit
from imkit._recording import _text

FRAMES = {
    "dict": dict,
    "pandas": pandas.DataFrame,
    "polars": polars.DataFrame,
    "arrow": lambda columns: pyarrow.table(columns),
    "structured": lambda columns: np.rec.fromarrays(list(columns.values()), names=list(columns)),
}


def foreign(recording):
    """The same run as a bench writes it: milliseconds, phases, rpm."""
    turn = np.exp(-2j * np.pi / 3 * np.arange(3))
    u, i = recording.u_s, recording.i_s
    columns = {"t": 1e3 * recording.columns["t_s"], "n": recording.columns["omega_m_rad_s"] * 30 / np.pi, "T": recording.columns["tau_load_Nm"]}
    for k, name in enumerate("abc"):
        columns[f"u{name}"], columns[f"i{name}"] = (u * turn[k]).real, (i * turn[k]).real
    return columns


MAPPING = {
    "time": {"column": "t", "unit": "ms"},
    "voltage": {"a": "ua", "b": "ub", "c": "uc"},
    "current": {"a": "ia", "b": "ib", "c": "ic"},
    "speed": {"column": "n", "unit": "rpm"},
    "load": {"column": "T"},
}


@pytest.mark.parametrize("kind", FRAMES)
def test_any_data_frame_with_a_mapping_is_the_same_recording(motor, recording, kind):
    frame = FRAMES[kind](foreign(recording))
    mapped = imkit.compare(motor, imkit.Recording.from_frame(frame, MAPPING))
    assert mapped.guessed == [] and "? " not in str(mapped)
    plain = imkit.compare(motor, recording)
    assert mapped.rms_in_sigma == pytest.approx(plain.rms_in_sigma, rel=1e-6)


def test_what_is_guessed_of_a_frame_is_said(motor, recording):
    c = foreign(recording)
    guessed = imkit.compare(motor, {"t_ms": c["t"], "u_a": c["ua"], "u_b": c["ub"], "u_c": c["uc"], "i_a": c["ia"], "i_b": c["ib"], "n_rpm": c["n"]})
    assert any("n_rpm" in g for g in guessed.guessed) and str(guessed).startswith("? ")


def test_files_frames_and_arrays_are_one(motor, recording, tmp_path):
    recording.write_csv(tmp_path / "run.csv")
    recording.to_frame().to_parquet(tmp_path / "run.parquet", compression="snappy")
    imkit.mat.write(tmp_path / "run.mat", recording)
    c = recording.columns
    arrays = imkit.Recording.from_arrays(
        t_s=c["t_s"], u_s=recording.u_s, i_s=recording.i_s, omega_m_rad_s=c["omega_m_rad_s"], tau_load_nm=c["tau_load_Nm"]
    )
    wanted = imkit.compare(motor, recording).rms_in_sigma
    for given in [tmp_path / "run.csv", tmp_path / "run.parquet", tmp_path / "run.mat", arrays, recording.to_frame()]:
        assert imkit.compare(motor, given).rms_in_sigma == pytest.approx(wanted, rel=1e-12)


def test_a_recording_can_be_sent_to_another_process(motor, recording):
    again = pickle.loads(pickle.dumps(recording))
    assert imkit.compare(motor, again).rms_in_sigma == imkit.compare(motor, recording).rms_in_sigma


def test_the_columns_of_a_file_are_there_to_look_at(motor, recording, tmp_path):
    recording.write_csv(tmp_path / "run.csv")
    given = imkit.Recording.from_file(tmp_path / "run.csv")
    assert list(given.columns) == list(recording.columns)
    assert np.array_equal(given.u_s, recording.u_s) and np.array_equal(given.to_frame()["t_s"], recording.columns["t_s"])
    # A bench's own text, with the separators of its country, and with what its mapping says of them.
    german = tmp_path / "lauf.csv"
    german.write_text("Zeit;I1;I2;Name\n0,0;1,5;2,5;a\n0,1;2,5;1,5;b\n0,2;-1,5;0,5;c\n")
    columns = imkit.Recording.from_file(german).columns
    assert columns["I1"].tolist() == [1.5, 2.5, -1.5] and np.all(np.isnan(columns["Name"]))
    with pytest.raises(imkit.InputError, match="cannot read it"):
        imkit.Recording.from_file(tmp_path / "none.csv")


def test_recordings_of_one_name_are_told_apart(motor, recording):
    columns = recording.columns
    broken = columns | {"i_alpha_A": np.full_like(columns["t_s"], np.nan)}
    with pytest.raises(imkit.InputError, match="^data frame 2, row 0 "):
        imkit.compare(motor, [imkit.Recording.from_frame(columns), imkit.Recording.from_frame(broken)])


def test_what_is_wrong_is_said(motor, recording):
    columns = dict(recording.columns)
    with pytest.raises(imkit.InputError, match=r"\[current\]"):
        imkit.compare(motor, {k: v for k, v in columns.items() if k != "i_beta_A"})
    with pytest.raises(imkit.InputError, match="u_beta_V.*9 rows"):
        imkit.compare(motor, columns | {"u_beta_V": np.zeros(9)})
    with pytest.raises(imkit.InputError, match="too few"):
        imkit.compare(motor, {k: v[:100] for k, v in columns.items()})
    with pytest.raises(imkit.InputError, match="mapping"):
        imkit.diagnose(motor, imkit.Recording.from_frame(foreign(recording)))
    with pytest.raises(imkit.InputError, match="parrot"):
        imkit.Recording.from_frame(foreign(recording), {"parrot": {"column": "t"}})
    broken = columns["i_alpha_A"].copy()
    broken[700] = np.nan
    with pytest.raises(imkit.InputError, match=r"^data frame, row 700 \(the first is 0\): i_alpha_A is empty"):
        imkit.compare(motor, columns | {"i_alpha_A": broken})


def test_what_is_wrong_with_a_mapping_is_said_by_its_key(motor, recording):
    wrong = MAPPING | {"voltage": {"a": "ua", "b": "ub", "c": "ux"}}
    given = imkit.Recording.from_frame(foreign(recording), wrong)
    for one in [given, pickle.loads(pickle.dumps(given))]:
        with pytest.raises(imkit.InputError, match=r'^mapping\["voltage"\]: column ux is missing'):
            imkit.compare(motor, one)
    with pytest.raises(imkit.InputError, match=r'^mapping\["speed"\]: unit is "knots"'):
        imkit.Recording.from_frame(foreign(recording), MAPPING | {"speed": {"column": "n", "unit": "knots"}})
    with pytest.raises(imkit.InputError, match=r"^mapping:2: "):
        imkit.Recording.from_frame(foreign(recording), "[time]\nsample = 1\n")


def test_a_mapping_is_drafted(motor, recording):
    draft = imkit.Recording.from_frame(foreign(recording)).draft(motor)
    assert "[voltage]" in draft and '"ua"' in draft
    assert recording.draft(motor) is None


def test_mat_files_hold_structs_and_odd_names(tmp_path):
    import scipy.io

    t = np.arange(5.0)
    scipy.io.savemat(tmp_path / "bench.mat", {"data": {"ia": t, "ib": 2 * t}, "t": t, "note": "hello", "gain": 3.0})
    columns = imkit.mat.columns_of(tmp_path / "bench.mat")
    assert sorted(columns) == ["data.ia", "data.ib", "t"] and np.array_equal(columns["data.ib"], 2 * t)
    imkit.mat.write(tmp_path / "out.mat", {"a.b": t, "words": np.array(["x"] * 5)})
    assert list(imkit.mat.columns_of(tmp_path / "out.mat")) == ["a_b"]


def test_a_mat_file_of_version_7_3_is_read(motor, recording, tmp_path):
    """As MATLAB writes it: HDF5 behind its header, a column as a row, a complex number of two fields, words and cells beside."""
    import h5py

    c = recording.columns
    with h5py.File(tmp_path / "bench.mat", "w", userblock_size=512) as file:
        bench = file.create_group("bench")
        bench.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, values in c.items():
            bench.create_dataset(name, data=values.reshape(1, -1))
        i = np.zeros((1, len(c["t_s"])), dtype=[("real", "f8"), ("imag", "f8")])
        i["real"], i["imag"] = recording.i_s.real, recording.i_s.imag
        file.create_dataset("i", data=i)
        note = file.create_dataset("note", data=np.zeros((1, 99_999), dtype=np.uint16))
        note.attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#").create_dataset("a", data=np.zeros((1, 99_999)))
    with open(tmp_path / "bench.mat", "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512))
    columns = imkit.mat.columns_of(tmp_path / "bench.mat")
    assert sorted(columns) == sorted([f"bench.{name}" for name in c] + ["i.im", "i.re"])
    assert np.array_equal(columns["i.im"], recording.i_s.imag)
    mapping = {
        "time": {"column": "bench.t_s", "unit": "s"},
        "voltage": {"alpha": "bench.u_alpha_V", "beta": "bench.u_beta_V"},
        "current": {"alpha": "i.re", "beta": "i.im"},
        "speed": {"column": "bench.omega_m_rad_s", "unit": "rad/s"},
        "load": {"column": "bench.tau_load_Nm"},
    }
    mapped = imkit.Recording.from_frame(columns, mapping)
    assert imkit.compare(motor, mapped).rms_in_sigma == pytest.approx(imkit.compare(motor, recording).rms_in_sigma, rel=1e-12)


def test_what_is_no_mat_file_is_said(tmp_path):
    (tmp_path / "no.mat").write_text("parrot " * 40)
    with pytest.raises(imkit.InputError, match="no.mat"):
        imkit.Recording.from_file(tmp_path / "no.mat")
    with pytest.raises(imkit.InputError, match="none.mat: cannot read it"):
        imkit.Recording.from_file(tmp_path / "none.mat")


class Stream:
    """A table that nobody knows, but for its Arrow stream."""

    def __init__(self, table):
        self._table = table

    def __arrow_c_stream__(self, requested_schema=None):
        return self._table.__arrow_c_stream__(requested_schema)


def test_what_is_missing_is_not_a_number_and_words_are_left_out(recording):
    from imkit._frames import columns_of

    whole = pandas.DataFrame({"n": pandas.array([1, None, 3], dtype="Int64"), "x": [1.5, None, 2.5], "who": ["a", "b", "c"]})
    for frame in [whole, polars.DataFrame({"n": [1, None, 3], "x": [1.5, None, 2.5], "who": ["a", "b", "c"]})]:
        columns = columns_of(frame)
        assert list(columns) == ["n", "x"]
        assert np.array_equal(columns["n"], [1, np.nan, 3], equal_nan=True)
    canonical = columns_of(Stream(pyarrow.table(recording.columns)))
    assert np.array_equal(canonical["i_alpha_A"], recording.columns["i_alpha_A"])


def test_a_recording_keeps_what_it_was_made_from(motor, recording):
    columns = {name: values.copy() for name, values in recording.columns.items()}
    kept = imkit.Recording.from_frame(columns)
    speed = columns["omega_m_rad_s"].copy()
    columns["omega_m_rad_s"][:] = 0.0
    again = pickle.loads(pickle.dumps(kept))
    assert np.array_equal(again.columns["omega_m_rad_s"], speed) and np.array_equal(kept.columns["omega_m_rad_s"], speed)


def test_arrays_may_lack_a_speed_and_numbers_stand_for_arrays(motor, recording):
    c = recording.columns
    blind = imkit.Recording.from_arrays(t_s=c["t_s"], u_s=recording.u_s, i_s=recording.i_s, tau_load_nm=c["tau_load_Nm"])
    assert imkit.fit(motor, blind).rms_in_sigma < 2.0
    made = imkit.Recording.from_arrays(t_s=c["t_s"], u_s=recording.u_s, i_s=recording.i_s, tau_load_nm=3.0)
    assert "omega_m_rad_s" not in made.columns and np.all(made.columns["tau_load_Nm"] == 3.0)
    with pytest.raises(imkit.InputError, match="i_s: an array of 2 dimensions"):
        imkit.Recording.from_arrays(t_s=c["t_s"], u_s=recording.u_s, i_s=recording.i_s[None, :])
    with pytest.raises(imkit.InputError, match="t_s: complex"):
        imkit.Recording.from_arrays(t_s=c["t_s"] + 0j, u_s=recording.u_s, i_s=recording.i_s)


def test_what_a_mask_hides_is_missing_and_an_index_is_a_column():
    pandas = pytest.importorskip("pandas")
    made = imkit.Recording.from_frame({"a": np.ma.masked_array([1.0, 99.0, 3.0], mask=[False, True, False])})
    assert np.array_equal(made.columns["a"], [1.0, np.nan, 3.0], equal_nan=True)
    frame = pandas.DataFrame({"t_s": [0.0, 0.1], "a": [1.0, 2.0]}).set_index("t_s")
    assert list(imkit.Recording.from_frame(frame).columns) == ["t_s", "a"]
    spans = pandas.DataFrame({"t": pandas.to_timedelta([0, 250], unit="ms")})
    assert np.allclose(imkit.Recording.from_frame(spans).columns["t"], [0.0, 0.25])


def test_a_mapping_may_be_a_file(motor, recording, tmp_path):
    frame, file = foreign(recording), tmp_path / "recording.toml"
    file.write_text(_text(MAPPING))
    errors = [imkit.compare(motor, imkit.Recording.from_frame(frame, m)).rms_in_sigma for m in (MAPPING, file, str(file))]
    assert errors[0] == errors[1] == errors[2]
    with pytest.raises(imkit.InputError, match="nowhere.toml: cannot read it"):
        imkit.Recording.from_frame(frame, "nowhere.toml")
    with pytest.raises(imkit.InputError, match="None is no text"):
        imkit.Recording.from_frame(frame, MAPPING | {"load": None})
    # Of a file's own columns, too.
    pandas.DataFrame(frame).to_csv(tmp_path / "bench.csv", index=False)
    given = [MAPPING, _text(MAPPING), file]
    errors = [imkit.compare(motor, imkit.Recording.from_file(tmp_path / "bench.csv", m)).rms_in_sigma for m in given]
    assert errors == pytest.approx([errors[0]] * 3, rel=1e-9)


def test_a_file_that_is_not_there_is_said_at_once(tmp_path):
    with pytest.raises(imkit.InputError, match="nope.csv: cannot read it: there is no such file"):
        imkit.Recording.from_file("nope.csv")
    with pytest.raises(imkit.InputError, match="it is a folder"):
        imkit.Recording.from_file(tmp_path)


def test_numbers_with_a_comma_are_no_words(recording):
    words = pandas.DataFrame({"t_s": [0.0, 0.1], "i_alpha_A": ["1,5", "-0,25"], "remark": ["on, off", "x"]})
    with pytest.raises(imkit.InputError, match="i_alpha_A: holds the text '1,5'.*decimal"):
        imkit.Recording.from_frame(words)
