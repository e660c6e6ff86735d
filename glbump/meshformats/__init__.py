"""Readers of mesh files: each takes a file's bytes and returns what it says, as `raw.Raw`.

They are glbump's own because a damaged or odd file must be refused or reported, never half read; docs/decisions.md
says what the library considered for it did. All raise MeshError, without the file's name.
"""
