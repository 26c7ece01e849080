"""Every figure draws the numbers it is given, names quantity and unit, and states level and uncertainty."""

import inspect
from dataclasses import replace
from functools import partial
from io import BytesIO

import matplotlib as mpl
import numpy as np
import pytest
import report_synthetic as case
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import synthetic_craft as synthetic
from towtank.figures import coefficients, forces, histories, paper, poles, series, shape, tracks
from towtank.trials.circle import turning_circle
from towtank.trials.zigzag import zigzag

approx = pytest.approx
SWEEP = poles.PoleSweep(
    "horizontal", "semi-empirical", np.array([0.5, 1.0, 1.5]),
    np.array([[-0.1 + 0.2j, -0.1 - 0.2j], [-0.2 + 0.4j, -0.2 - 0.4j], [-0.3 + 0.6j, -0.3 - 0.6j]]), {"G_h": 0.25},
)  # fmt: skip


def _run(name):
    return next(run for run in case.runs() if run.name == name)


def _trial(word):
    return next(trial for trial in case.trials() if word in trial.name)


def words(ax: Axes) -> str:
    return " ".join(text.get_text().replace("\n", " ") for text in ax.texts)


FIGURES = {
    "loads": lambda: forces.load_against_angle(case.runs(), "Y", "drift", case.derivatives()),
    "residual": lambda: forces.residual_against_angle(case.runs(), case.derivatives(), "N"),
    "fin load": lambda: forces.fin_load(case.runs(), "Y", "rudder", case.derivatives(), np.radians(20.0)),
    "shares": lambda: forces.shares(case.runs(), "Y"),
    "time series": lambda: series.time_series(_run("sway-2"), "", case.derivatives()),
    "hysteresis": lambda: series.hysteresis(_run("sway-2"), "vdot", "Y", case.derivatives()),
    "ensemble": lambda: series.ensemble(_run("yaw-1")),
    "residual per run": lambda: series.residual_per_run(case.runs(), case.derivatives()),
    "bars": lambda: coefficients.derivative_bars(case.derivatives()),
    "uncertainty": lambda: coefficients.uncertainty_shares(case.derivatives()),
    "plan view": lambda: tracks.plan_view(case.trials()),
    "depth": lambda: tracks.depth_profile(case.trials()),
    "circle": lambda: tracks.turning_circle(_trial("turning")),
    "zigzag": lambda: histories.zigzag(_trial("zigzag")),
    "spiral": lambda: histories.spiral(_trial("zigzag")),
    "pull-out": lambda: histories.pull_out(_trial("heading")),
    "step": lambda: histories.step(_trial("heading")),
    "fin angles": lambda: histories.fin_angles(_trial("lawnmower"), np.radians(25.0)),
    "fin effort": lambda: histories.fin_effort(case.trials()),
    "poles": lambda: poles.pole_map(SWEEP),
    "slowest mode": lambda: poles.real_parts([SWEEP]),
    "index": lambda: poles.stability_index("G_h", np.linspace(-1.0, 3.0, 401), 1.0, "semi-empirical"),
}


@pytest.mark.parametrize("name", FIGURES)
def test_figure_states_units_level_and_uncertainty(name):
    before = dict(mpl.rcParams)
    ax = FIGURES[name]()
    assert isinstance(ax, Axes)
    label = ax.get_xlabel() + ax.get_ylabel()
    assert "[" in label or "x 1000" in label or "share" in label
    level = paper.level_words("semi-empirical" if name in ("poles", "slowest mode", "index") else "known coefficients")
    assert level in words(ax)
    assert any(word in words(ax) for word in ("std", "band", "uncertainty", "samples", "ensemble", "members"))
    assert dict(mpl.rcParams) == before  # no global style


def test_the_semi_empirical_level_is_spelled_out():
    run = replace(_run("sway-1"), level="semi-empirical")
    assert "semi-empirical tank, not CFD, not experiment" in words(series.time_series(run))


def test_every_public_figure_takes_axes_and_gives_them_back():
    own = Figure().add_subplot()
    assert forces.load_against_angle(case.runs(), ax=own) is own
    for module in (forces, series, coefficients, tracks, histories, poles, shape):
        for name, function in inspect.getmembers(module, inspect.isfunction):
            public = function.__module__ == module.__name__ and not name.startswith("_")
            if public and name not in ("sweep", "residuals"):
                assert inspect.signature(function).parameters["ax"].default is None, name


def test_points_are_the_loads_and_the_fit_passes_through_them():
    # The runs come from these very coefficients, so run minus fit is round-off: 1e-9 of the largest load.
    ax = forces.load_against_angle(case.runs(), "Y", "drift", case.derivatives())
    data = forces.sweep(case.runs(), "Y", "drift")
    assert np.degrees(data.angle) == approx([-16, -8, -4, 0, 4, 8, 16], abs=1e-9)
    points = next(line for line in ax.lines if line.get_marker() == "o")
    assert points.get_ydata() == approx(data.load)
    left = forces.residual_against_angle(case.runs(), case.derivatives(), "Y").lines[0].get_ydata()
    assert np.abs(left).max() < 1e-9 * np.abs(data.load).max()


def test_error_bars_are_two_std_of_the_ensemble():
    data = forces.sweep(case.runs(), "Y", "drift")
    assert data.std == approx(np.std(case.SPREAD, ddof=1) * np.abs(data.load))


def test_origin_slope_is_drawn_as_a_tangent():
    ax = forces.load_against_angle(case.runs(), "Y", "drift", case.derivatives())
    line = next(line for line in ax.lines if line.get_label() == "slope at the origin")
    x, y = (np.asarray(values) for values in line.get_data())
    i = int(np.argmin(np.abs(x - 2.0)))
    v = -np.sin(np.radians(x[i]))  # v = -U sin(beta) at 1 m/s; u = U cos(beta)
    assert y[i] == approx(case.derivatives().origin["Yuv"] * v * np.cos(np.radians(x[i])))


def test_derivatives_about_another_point_draw_the_same_loads():
    # Moved by hand: about a point d ahead, N' = N - d Y and v' = v + d r. Steady drift has r = 0, so only N changes.
    d, it = 0.5, case.derivatives()
    values = it.as_dict()
    values |= {name: values[name] - d * values[twin] for name, twin in (("Nuv", "Yuv"), ("Nvv", "Yvv"))}
    moved = replace(
        it,
        values=np.array([values[name] for name in it.names]),
        reference=replace(it.reference, origin_from_nose=it.reference.origin_from_nose - d),
    )
    run = _run("drift-8")
    assert paper.modelled(moved, run)[0][:, [1, 5]] == approx(run.loads[:, [1, 5]])


def test_stall_is_marked_only_where_the_force_falls_again():
    ax = forces.fin_load(case.stalled(), "Y", "rudder")
    assert any("20 deg" in str(line.get_label()) for line in ax.lines)
    assert "no stall inside the sweep" in words(forces.fin_load(case.runs(), "Y", "rudder"))


def test_dropped_period_and_used_cycles_do_not_overlap():
    run = _run("sway-1")
    lines = {line.get_label(): line for line in series.time_series(run).lines}
    assert lines["dropped"].get_xdata()[-1] == lines["run"].get_xdata()[0] == run.history.time[run.settled[0]]


def test_hysteresis_loop_is_the_settled_record():
    run = _run("sway-2")
    line = next(line for line in series.hysteresis(run, "vdot", "Y").lines if line.get_label() == "run")
    assert line.get_xdata() == approx(run.history.nudot[run.settled, 1])
    assert line.get_ydata() == approx(run.loads[run.settled, 1])


def test_shares_add_up_to_the_total():
    ax = forces.shares(case.runs(), "Y")
    total = next(line for line in ax.lines if line.get_label() == "total").get_ydata()
    low = min(path.get_datalim(ax.transData).y0 for path in ax.collections)
    high = max(path.get_datalim(ax.transData).y1 for path in ax.collections)
    assert (low, high) == approx((total.min(), total.max()))


def test_circle_of_known_rate_has_its_geometric_diameter():
    # 1 m/s at 3 deg/s: radius 19.1 m. The track has 1 s steps, so marks lie within half a step, 0.5 m.
    radius = 1.0 / np.radians(3.0)
    text = words(tracks.turning_circle(_trial("turning")))
    tactical = float(text.split("tactical diameter ")[1].split(" m")[0])
    advance = float(text.split("advance ")[1].split(" m")[0])
    assert tactical == approx(2.0 * radius, abs=0.5)
    assert advance == approx(radius, abs=0.5)


def test_overshoot_is_the_swing_beyond_the_switch():
    trial = _trial("zigzag")
    angle = np.degrees(trial.attitude[:, 2] - trial.attitude[0, 2])
    switch = np.flatnonzero(np.diff(np.sign(trial.command[:, 0]))) + 1
    inside = angle[switch[0] : switch[1]]
    sense = np.sign(angle[switch[0]])
    expected = sense * (inside[np.argmax(sense * inside)] - angle[switch[0]])
    assert f"{expected:.1f}°" in words(histories.zigzag(trial))


def test_the_numbers_on_the_figures_of_a_trial_are_its_indices():
    craft = synthetic.model(synthetic.STABLE)
    swing, circle = zigzag(craft, "20 deg", "20 deg"), turning_circle(craft, "20 deg")
    drawn = words(histories.zigzag(swing))
    for name in ("first_overshoot", "second_overshoot"):
        assert f"{swing.indices[name][0]:.1f}°" in drawn
    drawn = words(tracks.turning_circle(circle))
    for name in ("advance", "transfer", "tactical_diameter"):
        assert f"{name.replace('_', ' ')} {circle.indices[name][0]:.1f} m" in drawn


def test_bars_keep_fit_and_model_form_apart():
    it = case.derivatives()
    ax = coefficients.derivative_bars(it, ["Yuv"])
    prime = 1000.0 * case.PRIMES["Yuv"]
    assert ax.patches[0].get_width() == approx(prime)
    bars = {bar.get_label(): bar.lines[2][0].get_segments() for bar in ax.containers if hasattr(bar, "lines")}
    ends = {label: np.ptp(np.concatenate(segments)[:, 0]) for label, segments in bars.items()}
    assert ends["fit, 2 std"] == approx(4.0 * 0.02 * abs(prime))
    assert ends["model form, 2 std"] == approx(4.0 * 0.15 * abs(prime))
    assert "none stated for mesh" in words(ax)


def test_pole_map_holds_every_eigenvalue_and_the_index():
    ax = poles.pole_map(SWEEP)
    offsets = ax.collections[0].get_offsets()
    assert sorted(map(tuple, offsets)) == sorted((z.real, z.imag) for z in SWEEP.eigenvalues.ravel())
    assert "G_h = +0.250" in words(ax)


def test_a_name_with_markup_is_drawn_as_it_stands():
    ax = series.time_series(replace(_run("sway-1"), name="$x_{$<b>"))
    ax.get_figure().savefig(BytesIO(), format="png")
    assert "$x_{$<b>" in ax.get_title(loc="left")


def test_picture_of_the_surface_drops_faces_that_look_away():
    # A cube: three of six faces are seen from a corner, two triangles each.
    from trimesh.creation import box

    cube = box((1.0, 1.0, 1.0))
    ax = shape.shaded(cube.vertices, cube.faces)
    assert len(ax.collections[0].get_paths()) == 6


def test_drawings_of_the_craft_name_their_axes():
    for draw in (partial(shape.side_view, case.craft()), partial(shape.stern_view, case.craft())):
        ax = draw()
        assert "[m]" in ax.get_xlabel()
        assert "[m]" in ax.get_ylabel()
        assert "no uncertainty" in words(ax)
