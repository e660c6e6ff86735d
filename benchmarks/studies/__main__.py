"""Usage: python -m benchmarks.studies [NAME...] [-o docs/studies] [--quick]."""

import sys

from benchmarks.studies.command import main

sys.exit(main())
