"""``python -m homeostat.knowledge.build``: a plant's graph from its engineering tables."""

import sys

from homeostat.knowledge.build.build import main

sys.exit(main())
