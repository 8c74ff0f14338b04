"""Palpate from Python: bake a body, press it, read what was recorded.

    import palpate
    palpate.bake("meshes/models/cube/model.toml", "cube.palpate.hdf")
    with palpate.Session("cube.palpate.hdf", palpate.Tool(radius=0.1)) as session:
        felt = session.step((0.5, 0.5, 1.05))
        print(felt.force)

All units are SI. Needs numpy; Body needs h5py too. The book describes it on its page "Python"."""

from .files import Body, Recording, read
from .library import Error
from .loop import Loop
from .programs import bake, bake_mesh, probe
from .session import Contacts, Felt, Overlay, Session, Tool
from .viewer import Viewer

__all__ = ["Body", "Contacts", "Error", "Felt", "Loop", "Overlay", "Recording", "Session", "Tool", "Viewer", "bake", "bake_mesh",
           "probe", "read"]
__version__ = "0.1.0"
