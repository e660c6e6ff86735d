"""The figures of docs/benchmarks.md, measured where this runs: `make bench`, or `python -m benchmarks --help`.

Each module measures one thing and runs alone as well: `python -m benchmarks.accuracy --quick`.
"""
