"""Writes the files in tests/data with the programs that other people use, and what those programs read back, as CSV.

    pip install numpy==2.4.6 scipy==1.17.1 h5py==3.16.0 asammdf==8.8.28 npTDMS==1.13.0 comtrade==0.2.0
    python tests/make.py

Every file holds the same channels: a voltage and a current sampled at 1 kHz, a speed sampled at 100 Hz, where the format has two rates.
"""

import csv
import struct
from pathlib import Path

import comtrade
import h5py
import numpy as np
import scipy.io
from asammdf import MDF, Signal
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter

DATA = Path(__file__).parent / "data"
N = 100
T = np.arange(N) / 1000
U = 325 * np.cos(2 * np.pi * 50 * T)
I = 8 * np.cos(2 * np.pi * 50 * T - 0.6)
T_SLOW = np.arange(N // 10) / 100
SPEED = 1480 * (1 - np.exp(-T_SLOW / 0.03))


def expect(name, columns):
    """The values as the program reads them, beside the file."""
    with open(DATA / (name + ".csv"), "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        out.writerows(zip(*([repr(float(x)) for x in column] for column in columns.values())))


def slow_on(axis):
    """The slow channel where every group has a value."""
    return np.interp(axis, T_SLOW, SPEED)


COMMON = T[T <= T_SLOW[-1]]


def two_rates(u="Voltage L1 (V)", i="Current L1 (A)", n="Speed (rpm)", cast=np.float64):
    k = len(COMMON)
    return {"t (s)": COMMON, u: U.astype(cast)[:k], i: I[:k], n: slow_on(COMMON)}


def mat():
    for name, packed in (("v6", False), ("v7", True)):
        path = DATA / f"{name}.mat"
        signals = np.zeros(2, dtype=[("values", object), ("label", object)])
        signals[0] = (U.reshape(-1, 1), "u scope")
        signals[1] = (I.reshape(-1, 1), "i scope")
        scipy.io.savemat(
            path,
            {
                "t": T.reshape(-1, 1),
                "u": U.astype(np.float32).reshape(-1, 1),
                "count": np.arange(N, dtype=np.int16).reshape(1, -1),
                "R": 4.8,
                "note": "a start",
                "t_slow": T_SLOW,
                "n": SPEED,
                "Scope": {"time": T.reshape(-1, 1), "signals": signals, "blockName": "drive/Scope"},
            },
            do_compression=packed,
        )
        back = scipy.io.loadmat(path, squeeze_me=True)
        k = len(COMMON)
        scope = back["Scope"]["signals"].item()
        expect(
            path.name,
            {
                "t (s)": back["t"][:k],
                "u": back["u"][:k],
                "count": back["count"][:k],
                "n": np.interp(COMMON, back["t_slow"], back["n"]),
                "u scope": scope[0]["values"][:k],
                "i scope": scope[1]["values"][:k],
            },
        )
    scipy.io.savemat(DATA / "matrix.mat", {"data": np.column_stack([T, U, I])})
    expect("matrix.mat", dict(zip(("data_1", "data_2", "data_3"), scipy.io.loadmat(DATA / "matrix.mat")["data"].T)))


def mat73():
    """As MATLAB writes it: 512 bytes of its own, dimensions turned, a class on everything, structures of arrays by reference."""
    path = DATA / "v73.mat"
    with h5py.File(path, "w", userblock_size=512, libver=("earliest", "v110")) as file:

        def put(where, name, values, kind="double", **how):
            data = where.create_dataset(name, data=values, **how)
            data.attrs["MATLAB_class"] = np.bytes_(kind)
            return data

        put(file, "t", T.reshape(1, -1), chunks=(1, 50), compression="gzip", shuffle=True)
        put(file, "u", U.astype(np.float32).reshape(1, -1), "single")
        put(file, "phases", np.vstack([I, -I]))
        put(file, "R", [[4.8]])
        put(file, "note", np.array([[ord(c)] for c in "a start"], dtype=np.uint16), "char")
        put(file, "t_slow", T_SLOW.reshape(1, -1))
        put(file, "n", SPEED.reshape(1, -1))
        refs = file.create_group("#refs#")
        scope = file.create_group("Scope")
        scope.attrs["MATLAB_class"] = np.bytes_("struct")
        put(scope, "time", T.reshape(1, -1))
        signals = scope.create_group("signals")
        signals.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, values, kind in (
            ("values", [U.reshape(1, -1), I.reshape(1, -1)], "double"),
            ("label", [np.array([[ord(c)] for c in s], dtype=np.uint16) for s in ("u scope", "i scope")], "char"),
        ):
            each = [put(refs, f"{field}{k}", v, kind).ref for k, v in enumerate(values)]
            signals.create_dataset(field, data=np.array([each], dtype=h5py.ref_dtype), dtype=h5py.ref_dtype)
    with open(path, "r+b") as file:
        head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Sun Nov 22 12:00:00 2026 HDF5 schema 1.00 ."
        file.write(head.ljust(116) + bytes(8) + b"\x00\x02IM")
    with h5py.File(path) as file:
        k = len(COMMON)
        expect(
            path.name,
            {
                "t (s)": file["t"][0, :k],
                "n": np.interp(COMMON, file["t_slow"][0], file["n"][0]),
                "phases_1": file["phases"][0, :k],
                "phases_2": file["phases"][1, :k],
                "u": file["u"][0, :k],
                "u scope": file[file["Scope/signals/values"][0, 0]][0, :k],
                "i scope": file[file["Scope/signals/values"][0, 1]][0, :k],
            },
        )
    with h5py.File(DATA / "plain.h5", "w") as file:
        file["time"] = T
        file["u"] = U
    expect("plain.h5", {"time": T, "u": U})


def mdf():
    from asammdf.blocks import v4_blocks, v4_constants

    raw = np.round(U * 10).astype(np.int16)
    linear = v4_blocks.ChannelConversion(conversion_type=v4_constants.CONVERSION_TYPE_LIN, a=0.1, b=0.0)
    for name, how in (("plain", 0), ("packed", 1), ("turned", 2)):
        path = DATA / f"{name}.mf4"
        with MDF(version="4.10") as file:
            file.append(
                [
                    Signal(raw, T, unit="V", name="Voltage L1", conversion=linear),
                    Signal(I, T, unit="A", name="Current L1"),
                ],
                comment="fast",
            )
            file.append([Signal(SPEED.astype(np.float32), T_SLOW, unit="rpm", name="Speed")], comment="slow")
            file.save(path, compression=how, overwrite=True)
        with MDF(path) as file:
            u, i, n = (file.get(name) for name in ("Voltage L1", "Current L1", "Speed"))
            k = len(COMMON)
            assert np.allclose(u.timestamps, T) and np.allclose(n.timestamps, T_SLOW)
            expect(
                path.name,
                {
                    "t (s)": u.timestamps[:k],
                    "Voltage L1 (V)": u.samples[:k],
                    "Current L1 (A)": i.samples[:k],
                    "Speed (rpm)": np.interp(COMMON, n.timestamps, n.samples.astype(float)),
                },
            )


def tdms():
    path = DATA / "two_groups.tdms"
    start = np.datetime64("2026-11-22T12:00:00")

    def wave(group, name, values, unit, step, chunk):
        of = {"wf_start_time": start, "wf_start_offset": 0.0, "wf_increment": step, "wf_samples": 1, "unit_string": unit}
        return ChannelObject(group, name, values[chunk], properties=of)

    with TdmsWriter(path) as file:
        for k in range(4):
            fast = slice(25 * k, 25 * (k + 1))
            objects = [
                RootObject(properties={"title": "a start"}),
                GroupObject("fast"),
                wave("fast", "Voltage L1", U.astype(np.float32), "V", 1e-3, fast),
                wave("fast", "Current L1", I, "A", 1e-3, fast),
            ]
            if k == 3:
                objects.append(wave("slow", "Speed", SPEED, "rpm", 1e-2, slice(None)))
            file.write_segment(objects)
    back = TdmsFile.read(path)
    k = len(COMMON)
    expect(
        path.name,
        {
            "t (s)": back["fast"]["Current L1"].time_track()[:k],
            "Voltage L1 (V)": back["fast"]["Voltage L1"][:k],
            "Current L1 (A)": back["fast"]["Current L1"][:k],
            "Speed (rpm)": np.interp(COMMON, back["slow"]["Speed"].time_track(), back["slow"]["Speed"][:]),
        },
    )
    # As LabVIEW streams: one segment of many chunks, channels interleaved, the higher byte first; integers with a scale.
    for name, big, interleaved in (("chunks.tdms", "<", False), ("interleaved.tdms", ">", True)):
        u = np.round(U * 10).astype(np.int16)

        def text(s):
            return struct.pack(big + "I", len(s)) + s.encode()

        def number(key, kind, code, value):
            return text(key) + struct.pack(big + "I" + code, kind, value)

        meta = struct.pack(big + "I", 2)
        properties = [
            number("wf_increment", 10, "d", 1e-3),
            number("wf_start_offset", 10, "d", 0.0),
            number("NI_Number_Of_Scales", 7, "I", 1),
            text("NI_Scale[0]_Scale_Type") + struct.pack(big + "I", 0x20) + text("Linear"),
            number("NI_Scale[0]_Linear_Slope", 10, "d", 0.1),
            number("NI_Scale[0]_Linear_Y_Intercept", 10, "d", 0.5),
            number("NI_Scale[0]_Linear_Input_Source", 7, "I", 0xFFFFFFFF),
        ]
        for path_, kind, more in (("/'g'/'u'", 2, properties), ("/'g'/'i'", 10, properties[:2])):
            meta += text(path_) + struct.pack(big + "IIIQ", 20, kind, 1, 10)
            meta += struct.pack(big + "I", len(more)) + b"".join(more)
        raw = b""
        for k in range(0, N, 10):
            part_u, part_i = u[k : k + 10].astype(big + "i2"), I[k : k + 10].astype(big + "f8")
            if interleaved:
                raw += b"".join(a.tobytes() + b.tobytes() for a, b in zip(part_u, part_i))
            else:
                raw += part_u.tobytes() + part_i.tobytes()
        toc = 0x2 | 0x4 | 0x8 | (0x20 if interleaved else 0) | (0x40 if big == ">" else 0)
        lead = b"TDSm" + struct.pack("<I", toc) + struct.pack(big + "IQQ", 4713, len(meta) + len(raw), len(meta))
        (DATA / name).write_bytes(lead + meta + raw)
        back = TdmsFile.read(DATA / name)["g"]
        expect(name, {"t (s)": back["u"].time_track(), "u": back["u"][:], "i": back["i"][:]})


def comtrade_files():
    """By the rules of the standard; two analog channels, one status channel."""
    for kind, year in (("ASCII", 1999), ("BINARY", 1999), ("BINARY32", 2013), ("FLOAT32", 2013)):
        scale = {"ASCII": 0.01, "BINARY": 0.02, "BINARY32": 1e-5, "FLOAT32": 1.0}[kind]
        name = kind.lower()
        lines = [
            f"laboratory,recorder,{year}",
            "3,2A,1D",
            f"1,Voltage L1,A,,V,{scale},0.5,0,-99999,99998,1,1,P",
            f"2,Current L1,A,,A,{scale / 20},0,0,-99999,99998,1,1,P",
            "1,CLOSED,,,0",
            "50",
            "1",
            f"1000,{N}",
            "22/11/2026,12:00:00.000000",
            "22/11/2026,12:00:00.020000",
            kind,
            "1",
        ]
        if year == 2013:
            lines += ["0,0", "0,3"]
        (DATA / f"{name}.cfg").write_text("\r\n".join(lines) + "\r\n")
        raw = [(U - 0.5) / scale, I / (scale / 20)]
        if kind != "FLOAT32":
            raw = [np.round(x).astype(int) for x in raw]
        rows = []
        for k in range(N):
            stamp, state = int(round(T[k] * 1e6)), int(k >= 20)
            if kind == "ASCII":
                rows.append(f"{k + 1},{stamp},{raw[0][k]},{raw[1][k]},{state}\r\n".encode())
            else:
                code = {"BINARY": "h", "BINARY32": "i", "FLOAT32": "f"}[kind]
                rows.append(struct.pack(f"<II{code}{code}H", k + 1, stamp, raw[0][k], raw[1][k], state))
        (DATA / f"{name}.dat").write_bytes(b"".join(rows))
        back = comtrade.load(str(DATA / f"{name}.cfg"), str(DATA / f"{name}.dat"), use_double_precision=True)
        expect(f"{name}.cfg", {"t (s)": back.time, "Voltage L1 (V)": back.analog[0], "Current L1 (A)": back.analog[1]})


if __name__ == "__main__":
    DATA.mkdir(exist_ok=True)
    np.random.seed(1)
    mat()
    mat73()
    mdf()
    tdms()
    comtrade_files()
