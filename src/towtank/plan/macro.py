"""A plan as the text of a STAR-CCM+ macro, which runs its tests one after another in one simulation."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from towtank.craft.craft import Craft
from towtank.plan.kinds import CaptiveTest, Plan

CLASS = "TowtankPlan"
"""Name of the Java class; the file must be called after it."""

PLOT = "Towtank Loads"
"""Name of the monitor plot that the macro exports."""

MONITORS = ("Force X", "Force Y", "Force Z", "Moment X", "Moment Y", "Moment Z")
"""Reports whose monitors the plot holds, in the order X Y Z K M N."""

AMPLITUDES = ("surge", "sway", "heave", "yaw", "pitch", "roll")

STEADY_LENGTHS = 10.0
"""Lengths that a steady test is towed. Judgement: the water that met the start has left the hull several times over
before the last quarter, which is averaged."""

STEPS_PER_LENGTH = 100
"""Time steps of a steady test while it passes its own length. Judgement: only where it settles counts."""

STEPS_PER_PERIOD = 256
"""Least time steps in a period. Judgement: an implicit scheme of second order then turns the first harmonic by
(2 pi / 256)^2 / 3 = 2e-4 rad."""

_PART = 100

_TEXT = """\
// {name}.java: {count} captive tests of {craft}, one after another in one simulation.
//
// Written by towtank {version} from a plan. It has not been run in STAR-CCM+: it is written after the published Java
// interface (star.common). Try one test by hand first. What it assumes of the simulation:
//
//   1. Implicit unsteady, with the stopping criteria "Maximum Physical Time" (enabled) and "Maximum Steps" (disabled).
//   2. Global Parameters, scalar, in SI units and radians, of which field functions make the motion and the inlet:
{parameters}
//      One that a test does not use is set to 0. Sinusoids start at mid-path: amplitude * sin(Frequency * Time).
//      Yaw and Pitch keep the axis along the path: psi = atan(d(y)/dt / Speed), theta = -atan(d(z)/dt / Speed).
//      Signs as in towtank: x forward, y starboard, z down; drift positive with the bow to starboard, incidence
//      with the bow up. Fin angles are right-handed about the outward span.
//   3. A monitor plot "{plot}" with the monitors of the reports {monitors}
//      against "Physical Time". Their axes and moment point are stated in import.toml; edit them there.
//
// Each test clears the solution, runs, and exports the plot to monitors/<test>.csv beside the simulation file. A test
// whose file is there is passed over, so that a stopped campaign goes on. Then: towtank import import.toml
package macro;

import java.io.File;
import star.common.*;

public class {name} extends StarMacro {{

    private static final String[] PARAMETERS = {{
        {names}
    }};

    private Simulation sim;
    private File folder;

    @Override
    public void execute() {{
        sim = getActiveSimulation();
        folder = new File(sim.getSessionDir(), "monitors");
        folder.mkdirs();
{calls}
    }}

    /** Runs one test: values of PARAMETERS, end and step of time in seconds. */
    private void test(String name, double end, double step, double... values) {{
        File file = new File(folder, name + ".csv");
        if (file.exists()) {{
            sim.println("towtank: " + name + " is done");
            return;
        }}
        for (int i = 0; i < PARAMETERS.length; i++) {{
            ScalarGlobalParameter parameter =
                (ScalarGlobalParameter) sim.get(GlobalParameterManager.class).getObject(PARAMETERS[i]);
            parameter.getQuantity().setValue(values[i]);
        }}
        ((ImplicitUnsteadySolver) sim.getSolverManager().getSolver(ImplicitUnsteadySolver.class))
            .getTimeStep().setValue(step);
        ((PhysicalTimeStoppingCriterion) sim.getSolverStoppingCriterionManager()
            .getSolverStoppingCriterion("Maximum Physical Time")).getMaximumTime().setValue(end);
        sim.println("towtank: " + name);
        sim.clearSolution();
        sim.getSimulationIterator().run();
        ((MonitorPlot) sim.getPlotManager().getPlot("{plot}")).export(file.getPath(), ",");
    }}
{parts}
}}
"""


def parameters(craft: Craft) -> tuple[tuple[str, str], ...]:
    """Name and unit of the Global Parameters that the macro sets, in its order."""
    sizes = tuple((f"{kind.title()} Amplitude", "rad" if kind == "roll" else "m") for kind in AMPLITUDES)
    held = (("Speed", "m/s"), ("Drift", "rad"), ("Incidence", "rad"), ("Yaw Rate", "rad/s"))
    return (*held, *sizes, ("Frequency", "rad/s"), *((f"Fin {fin.name}", "rad") for fin in craft.fins))


def star_macro(plan: Plan) -> str:
    """Java text of a macro that runs the tests of ``plan``; its head says what it assumes of the simulation."""
    from towtank.provenance import VERSION

    listed = parameters(plan.craft)
    groups = [plan.tests[i : i + _PART] for i in range(0, len(plan.tests), _PART)]
    return _TEXT.format(
        name=CLASS,
        count=len(plan.tests),
        craft=plan.craft.name,
        version=VERSION,
        plot=PLOT,
        monitors=", ".join(MONITORS),
        parameters="\n".join(f"//        {name} [{unit}]" for name, unit in listed),
        names=",\n        ".join(json.dumps(name) for name, _ in listed),
        calls="\n".join(f"        part{number}();" for number in range(len(groups))),
        parts="\n".join(_part(number, group, plan.craft) for number, group in enumerate(groups)),
    )


def _part(number: int, tests: Sequence[CaptiveTest], craft: Craft) -> str:
    """One method: Java refuses methods of more than 64 kB."""
    lines = [f"        test({json.dumps(test.name)}, {_numbers(test, craft)});" for test in tests]
    return "\n".join(["", f"    private void part{number}() {{", *lines, "    }"])


def _numbers(test: CaptiveTest, craft: Craft) -> str:
    motion = test.motion
    angle = getattr(motion, "angle", 0.0)
    held = (test.speed, getattr(motion, "drift", angle if motion.kind == "drift" else 0.0))
    turned = (angle if motion.kind == "incidence" else 0.0, getattr(motion, "rate", 0.0))
    sizes = (getattr(motion, "amplitude", 0.0) if motion.kind == kind else 0.0 for kind in AMPLITUDES)
    frequency = 2.0 * math.pi / motion.period if motion.period else 0.0
    fins = test.fins or (0.0,) * len(craft.fins)
    return ", ".join(repr(float(value)) for value in (*timing(test, craft), *held, *turned, *sizes, frequency, *fins))


def timing(test: CaptiveTest, craft: Craft) -> tuple[float, float]:
    """End and step of time [s] of a test."""
    if test.motion.period:
        return test.periods * test.motion.period, test.motion.period / max(test.samples, STEPS_PER_PERIOD)
    return STEADY_LENGTHS * craft.length / test.speed, craft.length / test.speed / STEPS_PER_LENGTH
