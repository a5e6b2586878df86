"""``python -m meshlab_specsmooth`` is ``specsmooth``."""

import sys

from specsmooth import main

sys.exit(main())
