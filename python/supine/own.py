# SPDX-License-Identifier: AGPL-3.0-or-later
"""Effects and residuals of one's own, with derivatives that are checked before they are believed."""

import numpy as np

from ._supine import InputError, _add_effect

# A derivative that is none leaves a remainder that falls with order 1, one that is with order 2.
LEAST_ORDER = 1.9
STEP, HALVINGS = 1e-2, 4


def check_derivative(name, value, slope):
    """Whether `slope` is the derivative of value(step) at 0 (Taylor test).

    value: function of a step that gives an array. slope: array of the same shape.
    Raises InputError with the order at which the remainder falls.
    """
    base, slope = np.asarray(value(0.0), float), np.asarray(slope, float)
    if base.shape != slope.shape:
        raise InputError(f"{name}: its derivative has the shape {slope.shape}, its value {base.shape}")
    steps = STEP / 2.0 ** np.arange(HALVINGS + 1)
    moved = [np.asarray(value(step), float) for step in steps]
    left = np.array([np.linalg.norm(to - base - step * slope) for to, step in zip(moved, steps)])
    rounding = 1e-12 * max(np.linalg.norm(base), max(np.linalg.norm(to) for to in moved), 1e-300)
    if np.all(left <= rounding):  # along this step it is a straight line, and that one
        return
    order = np.min(np.log2(left[:-1] / np.maximum(left[1:], 1e-300)))
    if not order > LEAST_ORDER and left[-1] > rounding:
        raise InputError(f"{name}: what it gives as its derivative is not that of its value: the remainder falls with "
                         f"order {order:.2f} of the step (must be > {LEAST_ORDER})")


class Effect:
    """An effect of one's own; add_effect() makes it known to models, calibration and diagnosis.

    name, meaning: of the catalogue. parameters: supine.Parameter rows. kind: tissue or boundary. acts_in: every_pose,
    all_but_imaged or imaged_only.
    """

    name = ""
    meaning = ""
    parameters = ()
    kind = "tissue"
    acts_in = "every_pose"

    def apply(self, scene, values):
        """What it adds to fields: {field: number or array}; `ln_` before a field adds to its logarithm, which
        multiplies it. At null everything is zero. values: {parameter: number}."""
        raise NotImplementedError

    def derivative(self, scene, values):
        """{parameter: {field: array}}, for the fields that apply() names."""
        raise NotImplementedError

    def _changes(self, scene, values):
        changes = self.apply(scene, values)
        slopes = self.derivative(scene, values)
        for row in self.parameters:
            if set(slopes.get(row.name, ())) != set(changes):
                raise InputError(f"effect {self.name}: the derivative with respect to {row.name} is of the fields "
                                 f"{sorted(slopes.get(row.name, ()))}, the change of {sorted(changes)}")
        self._check(scene)
        return changes, slopes

    def _check(self, scene):
        """Once per pose and size of mesh: nothing at null, and the derivatives a third of the way into the ranges."""
        seen = self.__dict__.setdefault("_checked", set())
        key = (scene.pose, len(scene.cells))
        if key in seen:
            return
        at_null = self.apply(scene, {row.name: row.null for row in self.parameters})
        for field, change in at_null.items():
            if np.any(np.asarray(change) != 0):
                raise InputError(f"effect {self.name}: changes {field} at the null of its parameters, where it must "
                                 "leave the model as it is")
        middle = {row.name: row.null + (row.upper - row.null) / 3 for row in self.parameters}
        slopes = self.derivative(scene, middle)
        for row in self.parameters:
            reach = row.upper - row.lower

            def stacked(step, row=row, reach=reach):
                changed = self.apply(scene, {**middle, row.name: middle[row.name] + step * reach})
                return np.concatenate([np.ravel(changed[field]) for field in sorted(changed)])

            slope = np.concatenate([np.ravel(np.broadcast_to(slopes[row.name][field], np.shape(at_null[field]))) * reach
                                    for field in sorted(at_null)])
            check_derivative(f"effect {self.name}, parameter {row.name}", stacked, slope)
        seen.add(key)


class Residual:
    """A measurement of one's own, for calibrate(residuals=[...]): rows that are zero where shapes agree with it."""

    name = "residual"

    def value(self, shapes):
        """Rows, each over its own 1 sigma. shapes: {name: N by 3, mm}; `imaged`, `undeformed` and every pose."""
        raise NotImplementedError

    def derivative(self, shapes, moves):
        """How the rows change when the shapes move by `moves` ({name: N by 3, mm})."""
        raise NotImplementedError


def add_effect(effect):
    """Adds an effect of one's own to the catalogue, or puts it in the place of an earlier one of its name."""
    if not effect.name or not effect.parameters:
        raise InputError(f"effect {effect.name or type(effect).__name__}: needs a name and parameters")
    _add_effect(effect)
