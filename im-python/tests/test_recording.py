import pickle

import numpy as np
import pandas
import polars
import pyarrow
import pytest

import imkit

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
    plain = imkit.compare(motor, recording)
    assert mapped.rms_in_sigma == pytest.approx(plain.rms_in_sigma, rel=1e-6)


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
    with pytest.raises(imkit.InputError, match="702.*i_alpha_A"):
        imkit.compare(motor, columns | {"i_alpha_A": broken})


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
