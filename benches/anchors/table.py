"""Makes a table of what tests/physics/anchors.rs prints.

    table.py LOG -o FOLDER

Writes FOLDER/anchors.csv and FOLDER/anchors.html: each number as it was published, as the device and as the reference measured it, with standard
errors and distances in standard errors. Needs nothing but Python 3.9.
"""

import argparse
import csv
import html
import pathlib

FIELDS = ["number", "published", "device", "device_error", "device_z", "reference", "reference_error", "reference_z"]


def numbers(log):
    """By its name what was published, and what each of both measured: value, standard error, distance."""
    found = {}
    for line in log.splitlines():
        parts = line.split("\t")
        if len(parts) != 6:
            continue
        # The name of a test may stand before its first line.
        by = parts[0].split()[-1]
        if by in ("device", "reference"):
            found.setdefault(parts[1], {"number": parts[1], "published": parts[2]}).update(
                {by: parts[3], f"{by}_error": parts[4], f"{by}_z": parts[5]}
            )
    return list(found.values())


def page(rows):
    style = "body{font:15px sans-serif;max-width:70em;margin:2em auto}td,th{padding:.1em .7em;text-align:right}td:first-child,th:first-child{text-align:left}"
    head = "".join(f"<th>{field.replace('_', ', ')}</th>" for field in FIELDS)
    lines = "".join("<tr>" + "".join(f"<td>{html.escape(row.get(field, ''))}</td>" for field in FIELDS) + "</tr>" for row in rows)
    return (
        f"<!doctype html><meta charset=utf-8><title>Published numbers</title><style>{style}</style><h1>Published numbers of matter that scatters</h1>"
        "<p>z: distance in standard errors. Beside that, half a unit of the last published digit is open. Made by benches/anchors/run; sources and geometry stand in "
        f"tests/physics/anchors.rs.</p><table><tr>{head}</tr>{lines}</table>\n"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    rows = numbers(arguments.log.read_text())
    with open(arguments.output / "anchors.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)
    (arguments.output / "anchors.html").write_text(page(rows))
    distances = {by: [abs(float(row[f"{by}_z"])) for row in rows if f"{by}_z" in row] for by in ("device", "reference")}
    for by, of in distances.items():
        if of:
            print(f"{by}: {len(of)} numbers, {sum(z <= 1 for z in of)} within one standard error, {sum(z > 3 for z in of)} beyond three, the farthest {max(of):.1f}")


if __name__ == "__main__":
    main()
