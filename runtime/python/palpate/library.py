"""libpalpate.so by ctypes: structs and functions of palpate.h, which says what they mean."""

from __future__ import annotations

import ctypes
import operator
import os
import pathlib
import re
import shutil
from ctypes import POINTER, Structure, c_char_p, c_double, c_int, c_float, c_int32, c_int64, c_size_t, c_uint32, c_void_p


class Error(Exception):
    """What could not be done, and why. `hint`: what to do about it, empty where nothing is known. `code`: of an error of
    the library "argument", "file", "memory", "state", "incomplete" or "internal", as palpate.h has them; else empty."""

    def __init__(self, reason: str, hint: str = "", code: str = ""):
        super().__init__(f"{reason}\nhint: {hint}" if hint else reason)
        self.reason = reason
        self.hint = hint
        self.code = code

    @classmethod
    def of_text(cls, text: str, code: str = "") -> Error:
        """By what a program or the library says: lines `error: ...` and `hint: ...`."""
        lines = text.strip().splitlines()
        told = [re.sub(r"^error: (palpate_\w+: )?", "", line) for line in lines if line.startswith("error: ")]  # without functions of C
        return cls("\n".join(told or lines), text.strip().partition("\nhint: ")[2], code)


def whole(value: int, what: str, least: int = -(1 << 31), most: int = (1 << 31) - 1) -> int:
    """`value` where a C integer holds it, an int unless told: ctypes cuts others. Throws Error."""
    number = operator.index(value)
    if not least <= number <= most:
        raise Error(f"{what} is {number}", f"give {least} to {most}", "argument")
    return number


def path_text(path: str | os.PathLike[str]) -> str:
    """A path as a word of a command: one that begins with a dash is no option. Throws Error where it has a zero byte, at which
    C would cut it."""
    text = os.fsdecode(path)
    if "\0" in text:
        raise Error(f"{text!r} is not the name of a file", "leave out the zero byte", "argument")
    return "./" + text if text.startswith("-") else text


def path_bytes(path: str | os.PathLike[str]) -> bytes:
    """A path for C. Throws Error as `path_text`."""
    return os.fsencode(path_text(path))


class CTool(Structure):
    _fields_ = [("size", c_size_t), ("radius", c_double), ("length", c_double), ("coupling_stiffness", c_double),
                ("coupling_torsion", c_double), ("max_force", c_double), ("friction", c_double), ("reach", c_double),
                ("hand_over", c_double), ("disc_radius", c_double)]


class CPose(Structure):
    _fields_ = [("size", c_size_t), ("position", c_double * 3), ("orientation", c_double * 4), ("grab", c_int)]


class COverlay(Structure):
    _fields_ = [("size", c_size_t), ("refinement", c_int), ("rings", c_int), ("memory", c_size_t)]


class COptions(Structure):
    _fields_ = [("size", c_size_t), ("overlay", POINTER(COverlay)), ("dynamic_contact", c_int), ("tick", c_double),
                ("stress_ticks", c_int64), ("depth", c_int)]


class CResult(Structure):
    _fields_ = [("size", c_size_t), ("force", c_double * 3), ("torque", c_double * 3), ("tool_position", c_double * 3),
                ("tool_orientation", c_double * 4), ("contacts", c_int), ("local_stiffness", c_double * 9),
                ("local_point", c_double * 3), ("local_radius", c_double), ("force_error", c_double),
                ("left_out", c_int), ("greens_error", c_double), ("small_strain", c_double)]


class CContact(Structure):
    _fields_ = [("size", c_size_t), ("position", c_double * 3), ("normal", c_double * 3), ("force", c_double * 3)]


class CCounts(Structure):
    _fields_ = [("size", c_size_t), ("nodes", c_int32), ("simplices", c_int32), ("corners", c_int32)]


class CRecordOptions(Structure):
    _fields_ = [("size", c_size_t), ("tool", c_int), ("pictures", c_double)]


NOT_STEPPED = 1 << 15
ERROR_STATE = 4

FUNCTIONS = {
    "palpate_code_name": (c_char_p, [c_int]),
    "palpate_last_code": (c_int, []),
    "palpate_record": (c_int, [c_void_p, c_char_p, POINTER(CRecordOptions), c_char_p, c_size_t]),
    "palpate_record_end": (c_int, [c_void_p, c_char_p, c_size_t]),
    "palpate_status_name": (c_char_p, [c_uint32]),
    "palpate_create_with_options": (c_void_p, [c_char_p, POINTER(CTool), c_int, c_int, POINTER(COptions), c_char_p, c_size_t]),
    "palpate_destroy": (None, [c_void_p]),
    "palpate_step": (c_uint32, [c_void_p, POINTER(CPose)]),
    "palpate_get": (c_int, [c_void_p, c_int, POINTER(CResult)]),
    "palpate_get_contacts": (c_int, [c_void_p, c_int, POINTER(CContact), c_int, POINTER(c_int)]),
    "palpate_set_tool": (c_int, [c_void_p, c_int, POINTER(CTool)]),
    "palpate_reset": (c_int, [c_void_p]),
    "palpate_surface_counts": (c_int, [c_void_p, POINTER(CCounts)]),
    "palpate_surface_rest": (c_int, [c_void_p, POINTER(c_double)]),
    "palpate_surface_simplices": (c_int, [c_void_p, POINTER(c_int32)]),
    "palpate_surface_displacement": (c_int, [c_void_p, POINTER(c_double)]),
    "palpate_surface_stress": (c_int64, [c_void_p, POINTER(c_float), POINTER(c_float)]),
}


def prefixes() -> list[pathlib.Path]:
    """Where Palpate may be installed: around this package, and around the programs on PATH."""
    here = pathlib.Path(__file__).resolve()
    found = [parent for parent in here.parents if (parent / "bin" / "palpate-runtime").exists()]
    on_path = shutil.which("palpate-runtime")
    return found + ([pathlib.Path(on_path).resolve().parent.parent] if on_path else [])


def program(name: str) -> str:
    """The path of one of Palpate's programs. Throws Error where it is neither installed beside this package nor on PATH."""
    for prefix in prefixes():
        for folder in ("bin", name.removeprefix("palpate-")):  # installed; in a build folder
            if os.access(prefix / folder / name, os.X_OK):
                return str(prefix / folder / name)
    on_path = shutil.which(name)
    if on_path is None:
        raise Error(f"{name} is not found", "install Palpate, or put the folder of its programs on PATH")
    return on_path


def load() -> ctypes.CDLL:
    """The library, with the types of its functions. Throws Error where it is not found."""
    names = [prefix / folder / "libpalpate.so.0" for prefix in prefixes() for folder in ("lib", "lib64", "runtime")]
    names += [path for prefix in prefixes() for path in sorted(prefix.glob("lib/*/libpalpate.so.0"))]
    # Where the loader looks by itself it takes the variant for this processor (glibc-hwcaps).
    found = ["libpalpate.so.0" if path.is_relative_to("/usr/lib") else str(path) for path in names if path.exists()]
    for name in [*found, "libpalpate.so.0"]:
        try:
            library = ctypes.CDLL(name)  # its calls let other threads of Python go on
        except OSError:
            continue
        for function, (result, arguments) in FUNCTIONS.items():
            getattr(library, function).restype = result
            getattr(library, function).argtypes = arguments
        return library
    raise Error("libpalpate.so.0 is not found", "install Palpate, or put its folder on LD_LIBRARY_PATH")
