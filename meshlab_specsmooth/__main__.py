"""``python -m meshlab_specsmooth`` is ``specsmooth``."""

import sys

from meshlab_specsmooth.cli import main

sys.exit(main())
