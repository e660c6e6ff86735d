"""The gallery of `glbump demo`: scenes of one idea each, and the pictures they need, all of them computed.

Each scene is written as a file that `glbump render` draws as well, to be looked at and changed.
"""

from __future__ import annotations

from glbump.demo.gallery import EXHIBITS, Exhibit, chosen, write_gallery, write_maps

__all__ = ["EXHIBITS", "Exhibit", "chosen", "write_gallery", "write_maps"]
