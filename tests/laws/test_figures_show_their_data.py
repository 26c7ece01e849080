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
from towtank.derive.fin_curve import FinCurve
from towtank.figures import (
    coefficients,
    forces,
    frequency,
    histories,
    paper,
    poles,
    requirements,
    series,
    shape,
    tracks,
)
from towtank.trials.circle import turning_circle
from towtank.trials.reverse import reverse_spiral
from towtank.trials.speed import stopping
from towtank.trials.spiral import spiral
from towtank.trials.vertical import steep_dive
from towtank.trials.zigzag import zigzag
from towtank.verdict.table import Driver, Requirement

approx = pytest.approx
SWEEP = poles.PoleSweep(
    "horizontal", "semi-empirical", np.array([0.5, 1.0, 1.5]),
    np.array([[-0.1 + 0.2j, -0.1 - 0.2j], [-0.2 + 0.4j, -0.2 - 0.4j], [-0.3 + 0.6j, -0.3 - 0.6j]]), {"G_h": 0.25},
)  # fmt: skip


ASKED = (
    Requirement("turn", 30.0, "m", 40.0, True, "", "at most", 10.0, 5.0, 0.9, drivers=(Driver("Nuv", 2.0, 10.0, 0.2),)),
    Requirement("swing", 12.0, "deg", 10.0, False, "", "at most", -2.0, 4.0, 0.3, 0.8),
    Requirement("P", 0.6, "", 0.9, False, "", "at least", -0.3, 0.02, on_share=True),
    Requirement("pilot stable", -0.1, "1/s", 0.0, True, ""),
)


def _run(name):
    return next(run for run in case.runs() if run.name == name)


def _trial(word):
    return next(trial for trial in case.trials() if word in trial.name)


def words(ax: Axes) -> str:
    return " ".join(text.get_text().replace("\n", " ") for text in ax.texts)


MODELLED = ("poles", "slowest mode", "index", "chances", "margins")
FIGURES = {
    "loads": lambda: forces.load_against_angle(case.runs(), "Y", "drift", case.derivatives()),
    "residual": lambda: forces.residual_against_angle(case.runs(), case.derivatives(), "N"),
    "fin load": lambda: forces.fin_load(case.runs(), "Y", "rudder", case.derivatives(), np.radians(20.0)),
    "shares": lambda: forces.shares(case.runs(), "Y"),
    "time series": lambda: series.time_series(_run("sway-2"), "", case.derivatives()),
    "hysteresis": lambda: series.hysteresis(_run("sway-2"), "vdot", "Y", case.derivatives()),
    "ensemble": lambda: series.ensemble(_run("yaw-1")),
    "residual per run": lambda: series.residual_per_run(case.runs(), case.derivatives()),
    "frequency": lambda: frequency.against_frequency(case.frequency(), "Yuv"),
    "amplitude": lambda: frequency.against_amplitude(case.frequency(), "Yuv"),
    "one oscillation": lambda: frequency.against_frequency(case.frequency(), "Nur"),
    "bars": lambda: coefficients.derivative_bars(case.derivatives()),
    "uncertainty": lambda: coefficients.uncertainty_shares(case.derivatives()),
    "plan view": lambda: tracks.plan_view(case.trials()),
    "depth": lambda: tracks.depth_profile(case.trials()),
    "circle": lambda: tracks.turning_circle(_trial("turning")),
    "zigzag": lambda: histories.zigzag(_trial("zigzag")),
    "spiral": lambda: histories.spiral(_trial("zigzag")),
    "pull-out": lambda: histories.pull_out(_trial("heading")),
    "step": lambda: histories.step(_trial("heading")),
    "speed": lambda: histories.speed(case.trials()),
    "course": lambda: histories.course(_trial("heading")),
    "pitch": lambda: histories.pitch(_trial("heading")),
    "fin angles": lambda: histories.fin_angles(_trial("lawnmower"), np.radians(25.0)),
    "fin effort": lambda: histories.fin_effort(case.trials()),
    "poles": lambda: poles.pole_map(SWEEP),
    "slowest mode": lambda: poles.real_parts([SWEEP]),
    "index": lambda: poles.stability_index("G_h", np.linspace(-1.0, 3.0, 401), 1.0, "semi-empirical"),
    "chances": lambda: requirements.chances(ASKED, "semi-empirical", "60 samples"),
    "margins": lambda: requirements.margins(ASKED, "semi-empirical", "60 samples"),
}


@pytest.mark.parametrize("name", FIGURES)
def test_figure_states_units_level_and_uncertainty(name):
    before = dict(mpl.rcParams)
    ax = FIGURES[name]()
    assert isinstance(ax, Axes)
    label = ax.get_xlabel() + ax.get_ylabel()
    assert "[" in label or "x 1000" in label or "share" in label
    level = paper.level_words("semi-empirical" if name in MODELLED else "known coefficients")
    assert level in words(ax)
    assert any(word in words(ax) for word in ("std", "band", "uncertainty", "samples", "ensemble", "members"))
    assert dict(mpl.rcParams) == before  # no global style


def test_requirements_show_their_share_and_margin_in_the_colour_of_the_result():
    ax = requirements.chances(ASKED, "semi-empirical", "60 samples")
    bars = [(bar.get_width(), bar.get_facecolor()[:3]) for bar in ax.patches]
    assert [width for width, _ in bars] == approx([90.0, 30.0, 60.0])
    assert bars[1][1] == bars[2][1] != bars[0][1]
    assert [line.get_xdata()[0] for line in ax.lines] == approx([80.0, 90.0])  # what is asked for
    ax = requirements.margins(ASKED, "semi-empirical", "60 samples")
    assert [bar.get_width() for bar in ax.patches] == approx([2.0, -0.5])
    assert "Nuv" in words(ax)
    assert [label.get_text() for label in ax.get_yticklabels()] == ["turn", "swing"]


def test_the_slowest_mode_shows_the_band_of_the_drawn_craft():
    banded = replace(SWEEP, band=np.array([[-0.2, -0.3, -0.4], [0.0, -0.1, -0.2]]))
    ax = poles.real_parts([banded])
    assert ax.collections[0].get_paths()[0].vertices[:, 1].min() == approx(-0.4)
    assert "5 to 95 %" in words(ax)
    assert not poles.real_parts([SWEEP]).collections


def test_the_semi_empirical_level_is_spelled_out():
    run = replace(_run("sway-1"), level="semi-empirical")
    assert "semi-empirical tank, not CFD, not experiment" in words(series.time_series(run))


def test_every_public_figure_takes_axes_and_gives_them_back():
    own = Figure().add_subplot()
    assert forces.load_against_angle(case.runs(), ax=own) is own
    for module in (forces, series, frequency, coefficients, tracks, histories, poles, requirements, shape):
        for name, function in inspect.getmembers(module, inspect.isfunction):
            public = function.__module__ == module.__name__ and not name.startswith("_")
            if public and name not in ("sweep", "residuals", "levels"):
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


def _judged(**verdicts):
    quality = {"screening": {name.replace("_", "-"): {"verdict": found} for name, found in verdicts.items()}}
    return replace(case.derivatives(), quality=quality)


def test_a_run_is_marked_by_its_verdict_in_force_and_residual():
    it = _judged(drift_16="rejected", drift_8="down-weighted", drift_4="exploratory")
    for ax in (
        forces.load_against_angle(case.runs(), "Y", "drift", it),
        forces.residual_against_angle(case.runs(), it),
    ):
        marked = {line.get_marker(): line for line in ax.lines if line.get_marker() not in ("None", "|", "_", "")}
        assert marked["X"].get_xdata() == approx([16.0])
        assert marked["P"].get_xdata() == approx([4.0])
        assert {marked["X"].get_fillstyle(), marked["P"].get_fillstyle()} == {"none"}
        round_ones = [line for line in ax.lines if line.get_marker() == "o"]
        assert {line.get_fillstyle(): len(line.get_xdata()) for line in round_ones} == {"full": 4, "none": 1}
        names = [text for text in ax.get_legend_handles_labels()[1] if text in paper.MARKS]
        assert names == ["down-weighted", "rejected", "exploratory"]


def test_a_run_is_known_by_its_identity_where_names_repeat():
    run = _run("drift-8")
    it = replace(case.derivatives(), quality={"screening": {run.id: {"verdict": "rejected"}}})
    assert paper.verdicts_of([run, _run("drift-4")], it) == ["rejected", "accepted"]


def test_loops_of_a_rejected_run_say_so():
    ax = series.hysteresis(_run("sway-1"), "v", "Y", _judged(sway_1="rejected"))
    assert "(rejected)" in ax.get_title(loc="left")


def test_trends_pass_through_the_runs_and_end_in_the_limit():
    # The points are made of the trend; lines are drawn from its numbers, so they meet to round-off.
    it = case.frequency()
    for ax, x, level in (
        (frequency.against_frequency(it, "Yuv"), lambda p: p.frequency**2, lambda p: p.amplitude),
        (frequency.against_amplitude(it, "Yuv"), lambda p: p.amplitude, lambda p: p.frequency),
    ):
        slopes = [line for line in ax.lines if line.get_linestyle() == "-" and len(line.get_xdata()) == 2]
        fitted = [p for p in it.points if p.term == "Yuv" and p.verdict != "rejected"]
        assert len(slopes) == len({level(p) for p in fitted})
        for p in fitted:
            assert any(np.interp(x(p), *line.get_data()) == approx(p.value) for line in slopes)
        limit = next(line for line in ax.lines if line.get_marker() == "D")
        assert (limit.get_xdata(), limit.get_ydata()) == (approx([0.0]), approx([-200.0]))
        bars = next(bar for bar in ax.containers if bar.get_label() == "limit").lines[2][0].get_segments()
        assert sorted(bars[0][:, 1]) == approx([-220.0, -180.0])
        wide = next(line for line in ax.lines if line.get_label() == "wide fit")
        assert set(wide.get_ydata()) == {-210.0}


def test_rejected_and_doubtful_oscillations_are_open_and_lie_where_they_were_measured():
    ax = frequency.against_frequency(case.frequency(), "Yuv")
    cross = next(line for line in ax.lines if line.get_marker() == "X")
    rejected = next(p for p in case.frequency().points if p.verdict == "rejected")
    assert cross.get_fillstyle() == "none"
    assert (cross.get_xdata(), cross.get_ydata()) == (approx([9.0]), approx([rejected.value]))
    hollow = [line for line in ax.lines if line.get_marker() == "o" and line.get_fillstyle() == "none"]
    assert [list(line.get_xdata()) for line in hollow] == [[4.0]]


def test_one_oscillation_draws_no_trend_and_claims_no_limit():
    ax = frequency.against_frequency(case.frequency(), "Nur")
    assert not any(line.get_marker() == "D" for line in ax.lines)
    assert "no uncertainty of a limit" in words(ax)


def test_nearly_equal_amplitudes_are_one_level():
    centre, group = frequency.levels(np.array([0.429, 0.2, 0.443, 0.199, 0.447]))
    assert list(group) == [1, 0, 1, 0, 1]
    assert centre == approx([0.1995, 0.4397], abs=1e-4)


def test_a_term_that_no_oscillation_gives_is_refused_with_those_there_are():
    with pytest.raises(ValueError, match="no oscillation gives 'Yuudr'; the study has Yuv, Nur"):
        frequency.against_amplitude(case.frequency(), "Yuudr")


def test_the_budget_names_what_is_not_stated():
    assert "none stated for mesh" in words(coefficients.uncertainty_shares(case.derivatives()))


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


def test_fin_curve_is_drawn_beside_the_derivative():
    curve = FinCurve(np.radians(22.0), 0.1, 0.3, np.radians(6.0), "the test", std=(0.02, 0.0, 0.0, 0.0))
    ax = forces.fin_load(case.runs(), "Y", "rudder", replace(case.derivatives(), fin_curve=curve))
    lines = {str(line.get_label()): line for line in ax.lines}
    drawn = lines["fin curve, fins stall at 22 +- 2 deg"]
    angle = np.radians(drawn.get_xdata())
    # One degree of rudder is one degree of each X fin, and the run is at 1 m/s.
    assert drawn.get_ydata() == approx(case.derivatives()["Yuudr"] * curve(angle))
    assert lines["derivative"].get_ydata() == approx(case.derivatives()["Yuudr"] * angle)


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


def test_both_spirals_are_drawn_in_one_figure_with_their_own_points():
    craft = synthetic.model(synthetic.SUBOFF)
    direct, reverse = spiral(craft, "15 deg"), reverse_spiral(craft)
    lines = {line.get_label(): line for line in histories.spiral([direct, reverse]).lines}
    held = reverse.provenance["curves"]["reverse spiral"]
    assert lines["reverse spiral"].get_xdata() == approx(held["rudder"])
    assert lines["reverse spiral"].get_ydata() == approx(held["rate"])
    swept = np.concatenate([lines[name].get_ydata() for name in ("first sweep", "back")])
    assert np.sort(swept) == approx(np.sort(direct.provenance["curves"]["spiral"]["rate"]))
    assert {"first sweep", "back"}.isdisjoint(line.get_label() for line in histories.spiral(reverse).lines)


def test_the_speed_of_a_stop_lies_on_its_closed_form():
    lines = histories.speed(stopping(synthetic.model(synthetic.STABLE), 0.0)).lines
    drawn, alone = lines[0], lines[1]
    assert alone.get_label() == "surge alone, closed form"
    assert np.interp(drawn.get_xdata(), *alone.get_data()) == approx(drawn.get_ydata(), abs=2e-3)


def test_a_dive_shows_the_pitch_that_was_asked_for():
    trial = steep_dive(synthetic.model(synthetic.STABLE), "20 deg", "10 m", "3 m/s")
    lines = {line.get_label(): line for line in histories.pitch(trial).lines}
    assert lines["pitch"].get_ydata() == approx(np.degrees(trial.attitude[:, 1]))
    assert lines["pitch asked"].get_ydata()[0] == approx(-20.0)
    assert lines["elevator"].get_ydata() == approx(np.degrees(trial.command[:, 1]))


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
