"""Where the sun stands by pvlib (NREL's solar position algorithm), for tests/scene/sun.rs.

    python -W error sun_positions.py DATE,LATITUDE,LONGITUDE ...

Prints a line for each: azimuth and elevation in degrees, without refraction, and the distance in astronomical units.
"""

import sys

import pandas as pd
from pvlib import solarposition

for argument in sys.argv[1:]:
    date, latitude, longitude = argument.split(",")
    moment = pd.DatetimeIndex([pd.Timestamp(date).tz_convert("UTC")])
    # Delta T as estimated for the date: the default is that of one year.
    sun = solarposition.spa_python(moment, float(latitude), float(longitude), altitude=0, delta_t=None)
    distance = solarposition.nrel_earthsun_distance(moment, delta_t=None)
    print(repr(float(sun["azimuth"].iloc[0])), repr(float(sun["elevation"].iloc[0])), repr(float(distance.iloc[0])))
