"""Size, channel means and their standard errors of a reference picture (.npz of ../shared/import), as JSON."""
import json
import sys

import numpy

reference = numpy.load(sys.argv[1])
height, width, channels = reference["image"].shape
means = reference["image"].reshape(-1, channels).mean(0, dtype=float)
print(json.dumps({"size": [width, height], "mean": list(means), "sem": list(map(float, reference["mean_sem"]))}))
