//! The nominal model against solutions by scipy (`tests/reference`), and against closed forms.

use sinew::GRAVITY;
use sinew::measurement::{Recording, Signal};
use sinew::model::Simulator;
use sinew::parameters::Parameters;
use sinew::plant::{PneumaticMuscle, equilibrium};
use sinew::simulation::closed_loop;
use std::path::Path;

/// Largest differences of measured contraction (m) and pressure (Pa) from a golden file.
fn differences(preset: &str, file: &str, effect: &[(&str, f64)]) -> (f64, f64) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(file);
    let golden = Recording::read(&path, &[]).unwrap();
    let column = |signal| golden.get(signal).unwrap();
    let (command, pressure) = (column(Signal::Command), column(Signal::GaugePressure));
    let contraction = column(Signal::Contraction);
    let mut parameters = Parameters::preset(preset).unwrap();
    parameters.load.mass = golden.load_mass().unwrap();
    parameters.initial.gauge_pressure = parameters.valve.target_pressure(command[0]);
    effect.iter().for_each(|(name, value)| parameters.set(name, *value).unwrap());
    let mut muscle = Simulator::<PneumaticMuscle>::new(parameters);
    muscle.inputs.command = command[0];
    muscle.initialize(0.0).unwrap();
    let (mut worst_contraction, mut worst_pressure) = (0.0_f64, 0.0_f64);
    for k in 0..golden.time.len() {
        let out = muscle.outputs();
        worst_contraction = worst_contraction.max((out.measured_contraction - contraction[k]).abs());
        worst_pressure = worst_pressure.max((out.gauge_pressure - pressure[k]).abs());
        if k + 1 < golden.time.len() {
            let span = golden.time[k + 1] - golden.time[k];
            muscle.inputs.command = command[k];
            muscle.slopes.command = (command[k + 1] - command[k]) / span;
            muscle.advance(span).unwrap();
        }
    }
    (worst_contraction, worst_pressure)
}

#[test]
fn trajectories_agree_with_scipy() {
    let cases = [
        ("dmsp-40-1000", "nominal_staircase_20kg.csv"),
        ("dmsp-40-1000", "nominal_staircase_80kg.csv"),
        ("dmsp-40-1000", "nominal_ramps_20kg.csv"),
        ("dmsp-40-1000", "nominal_ramps_80kg.csv"),
        ("dmsp-40-1000", "nominal_multisine_20kg.csv"),
        ("dmsp-40-1000", "nominal_multisine_80kg.csv"),
        ("dmsp-40-1000/improved-mckibben", "improved_mckibben_multisine_40kg.csv"),
        ("dmsp-40-290", "short_muscle_multisine_40kg.csv"),
    ];
    for (preset, file) in cases {
        let (contraction, pressure) = differences(preset, file, &[]);
        println!("{file}: contraction within {contraction:.1e} m, pressure within {pressure:.1e} Pa");
        assert!(contraction < 1e-6 && pressure < 1.0, "{file}: {contraction} m, {pressure} Pa");
    }
}

#[test]
fn effects_agree_with_scipy() {
    let cases: &[(&str, &[(&str, f64)])] = &[
        (
            "creep",
            &[("creep.amplitude_1", 0.1), ("creep.time_1", 1.5), ("creep.amplitude_2", 0.05), ("creep.time_2", 8.0)],
        ),
        ("uneven_creep", &[("creep.amplitude_1", 0.1), ("creep.time_1", 1.5), ("creep.return_ratio", 2.0)]),
        (
            "known_creep",
            &[
                ("creep.amplitude_1", 0.1),
                ("creep.time_1", 1.5),
                ("creep.relaxed_share", 0.0),
                ("creep.settled_share", 1.0),
                ("creep.nominal_share", 0.5),
            ],
        ),
        (
            "pressure_creep",
            &[
                ("creep.pressure_drift_1", 9e-3),
                ("creep.time_1", 1.5),
                ("creep.pressure_drift_2", 4e-3),
                ("creep.time_2", 8.0),
                ("creep.relaxed_share", 0.0),
                ("creep.settled_share", 1.0),
                ("creep.nominal_share", 0.5),
            ],
        ),
        (
            "spectrum_creep",
            &[
                ("creep.spectrum_amplitude", 0.12),
                ("creep.spectrum_exponent", 0.3),
                ("creep.relaxed_share", 0.0),
                ("creep.settled_share", 0.5),
            ],
        ),
        ("pull_creep", &[("creep.pull_amplitude", 0.2), ("creep.time_1", 2.5)]),
        ("uneven_pull_creep", &[("creep.pull_amplitude", 0.2), ("creep.time_1", 2.5), ("creep.return_ratio", 3.0)]),
        (
            "known_pull_creep",
            &[
                ("creep.pull_amplitude", 0.2),
                ("creep.time_1", 2.5),
                ("creep.return_ratio", 3.0),
                ("creep.nominal_share", 1.0),
            ],
        ),
        (
            "activated_relaxation",
            &[
                ("creep.relaxing_stiffness_1", 1500.0),
                ("creep.time_1", 1.5),
                ("creep.relaxing_stiffness_2", 600.0),
                ("creep.time_2", 8.0),
                ("creep.activation", 120.0),
            ],
        ),
        ("resonance", &[("valve_resonance.natural_frequency", 25.0), ("valve_resonance.damping_ratio", 0.35)]),
        (
            "uneven_resonance",
            &[
                ("valve_resonance.natural_frequency", 25.0),
                ("valve_resonance.damping_ratio", 0.35),
                ("valve_resonance.emptying_excess", 0.5),
            ],
        ),
        (
            "relaxation",
            &[
                ("creep.relaxing_stiffness_1", 1500.0),
                ("creep.time_1", 1.5),
                ("creep.relaxing_stiffness_2", 600.0),
                ("creep.time_2", 8.0),
            ],
        ),
        (
            "regulator",
            &[
                ("valve_resonance.natural_frequency", 25.0),
                ("valve_resonance.damping_ratio", 0.35),
                ("valve_resonance.lead", 1.0),
            ],
        ),
        (
            "slow_regulator",
            &[
                ("valve_resonance.natural_frequency", 5.0),
                ("valve_resonance.damping_ratio", 0.5),
                ("valve_resonance.lead", 3.0),
            ],
        ),
        ("slower_when_short", &[("valve_lag.time_constant", 0.03), ("valve_lag.growth_with_contraction", 0.7)]),
        (
            "slow_near_target",
            &[
                ("valve_lag.time_constant", 0.03),
                ("valve_lag.excess_near_target", 2.0),
                ("valve_lag.near_target", 0.15e5),
            ],
        ),
        ("slow_tail", &[("valve_lag.second_time_constant", 0.8), ("valve_lag.second_share", 0.15)]),
        (
            "averaged_position",
            &[("contraction_sensor_delay.delay", 0.03), ("contraction_sensor_delay.averaging", 0.08)],
        ),
        (
            "filtered_position",
            &[
                ("contraction_sensor_delay.delay", 0.03),
                ("contraction_sensor_delay.averaging", 0.08),
                ("contraction_sensor_delay.filter_time", 0.05),
            ],
        ),
        ("filtering_position", &[("contraction_sensor_delay.filter_time", 0.05)]),
        ("dead_time", &[("valve_dead_time.delay", 0.0373)]),
        ("uneven_dead_time", &[("valve_dead_time.delay", 0.0373), ("valve_dead_time.falling_excess", 0.5)]),
        ("play", &[("valve_dead_band.play", 0.11)]),
        ("spread_play", &[("valve_dead_band.play", 0.11), ("valve_dead_band.play_spread", 0.8)]),
        ("growing_play", &[("valve_dead_band.play", 0.04), ("valve_dead_band.play_growth", 0.06)]),
        ("stiction", &[("valve_dead_band.stiction", 0.17)]),
        ("late_stiction", &[("valve_dead_band.stiction", 0.17), ("valve_dead_band.jump_time", 0.01)]),
        (
            "sliding",
            &[
                ("valve_dead_band.stiction", 0.12),
                ("valve_dead_band.play", 0.04),
                ("valve_dead_band.sliding_speed", 1e-3),
            ],
        ),
        ("overlap", &[("valve_dead_band.pressure_overlap", 6e3), ("valve_dead_band.overlap_steepness", 3.0)]),
        (
            "unlike_ports",
            &[
                ("valve_dead_band.pressure_overlap", 6e3),
                ("valve_dead_band.overlap_steepness", 3.0),
                ("valve_dead_band.emptying_excess", 1.5),
            ],
        ),
        (
            "rounded_ports",
            &[("valve_dead_band.pressure_overlap", 6e3), ("valve_dead_band.overlap_rounding", 2.0 / 3.0)],
        ),
        ("resting_regulator", &[("valve_dead_band.waking", 8e3)]),
        (
            "thinning_damping",
            &[
                ("viscous_damping.contraction", 150.0),
                ("viscous_damping.extension", 320.0),
                ("viscous_damping.thinning", 25.0),
            ],
        ),
        (
            "flow_limit",
            &[
                ("flow_limit.filling", 1.2e5),
                ("flow_limit.emptying", 0.8e5),
                ("flow_limit.roundness", 0.25),
                ("flow_limit.emptying_with_pressure", 0.4),
                ("flow_limit.volume_growth", 0.3),
            ],
        ),
        (
            "nozzle",
            &[
                ("flow_limit.filling", 1.2e5),
                ("flow_limit.emptying", 0.8e5),
                ("flow_limit.roundness", 0.25),
                ("flow_limit.volume_growth", 0.3),
                ("flow_limit.supply_pressure", 4e5),
                ("flow_limit.critical_ratio", 0.4),
            ],
        ),
        (
            "moving_volume",
            &[
                ("flow_limit.filling", 1.2e5),
                ("flow_limit.emptying", 0.8e5),
                ("flow_limit.roundness", 0.25),
                ("flow_limit.volume_growth", 0.8),
                ("flow_limit.volume_bend", 0.15),
                ("flow_limit.polytropic_exponent", 1.2),
            ],
        ),
        ("leakage", &[("leakage.rate", 0.8), ("leakage.choked_share", 0.4), ("leakage.volume_growth", 0.4)]),
        ("tear", &[("leakage.rate", 0.6), ("leakage.opening_with_contraction", 1.5)]),
        (
            "crack",
            &[
                ("leakage.rate", 0.05),
                ("leakage.opening_with_contraction", 50.0),
                ("leakage.opening_contraction", 0.06),
            ],
        ),
        ("shut_at_rest", &[("leakage.rate", 0.2), ("leakage.shut_after", 0.7)]),
        ("lifting_seal", &[("leakage.rate", 0.8), ("leakage.opening_pressure", 0.9e5), ("leakage.volume_growth", 0.4)]),
        (
            "small_tank",
            &[
                ("supply_saturation.gauge_pressure", 1.85e5),
                ("supply_saturation.usage", 4.0),
                ("supply_saturation.recovery_time", 2.5),
            ],
        ),
        ("soft_ceiling", &[("supply_saturation.gauge_pressure", 1.9e5), ("supply_saturation.sharpness", 7.0)]),
        (
            "two_switches",
            &[
                ("supply_saturation.gauge_pressure", 1.75e5),
                ("supply_saturation.span", 0.3e5),
                ("supply_saturation.period", 4.0),
                ("supply_saturation.phase", 0.375),
                ("supply_saturation.refill", 0.25),
            ],
        ),
        (
            "swinging_zero",
            &[
                ("valve_offset.offset", 0.12),
                ("valve_offset.swing", 0.036),
                ("valve_offset.swing_period", 8.5),
                ("valve_offset.swing_phase", 0.7),
            ],
        ),
        (
            "warming_scale",
            &[
                ("contraction_sensor_gain.relative_error", -0.05),
                ("contraction_sensor_gain.settling", -0.03),
                ("contraction_sensor_gain.settling_time", 2.0),
            ],
        ),
        (
            "bent_valve",
            &[("valve_gain.relative_error", 0.04), ("valve_gain.bend", -0.01), ("valve_gain.curvature", -0.012)],
        ),
        (
            "shifting_zero",
            &[
                ("contraction_sensor_offset.offset", 4e-3),
                ("contraction_sensor_offset.shift", -2.4e-3),
                ("contraction_sensor_offset.shift_time", 2.2),
                ("contraction_sensor_offset.shift_span", 0.6),
            ],
        ),
        (
            "warm_coil",
            &[
                ("temperature_drift.valve_change", -0.07),
                ("temperature_drift.time_constant", 4.0),
                ("temperature_drift.share_2", 1.0 / 3.0),
                ("temperature_drift.time_constant_2", 9.0),
            ],
        ),
        ("growing_muscle", &[("temperature_drift.length_change", 6e-3), ("temperature_drift.time_constant", 4.0)]),
        (
            "warm_by_work",
            &[
                ("temperature_drift.area_change", 0.02),
                ("temperature_drift.elastic_change", -0.03),
                ("temperature_drift.time_constant", 4.0),
                ("temperature_drift.work_share", 1.0),
            ],
        ),
        (
            "warm_by_way",
            &[
                ("temperature_drift.area_change", 0.02),
                ("temperature_drift.elastic_change", -0.03),
                ("temperature_drift.time_constant", 4.0),
                ("temperature_drift.work_share", 1.0),
                ("temperature_drift.speed_share", 0.75),
            ],
        ),
        (
            // Two lags in a row in partial fractions.
            "slow_start",
            &[
                ("temperature_drift.area_change", 0.05),
                ("temperature_drift.elastic_change", -0.1),
                ("temperature_drift.time_constant", 6.0),
                ("temperature_drift.share_2", -1.0),
                ("temperature_drift.time_constant_2", 3.0),
                ("temperature_drift.second", 0.3),
                ("temperature_drift.recording", 2.0),
            ],
        ),
        (
            "stiffer_end",
            &[
                ("bladder_stiffness.added_force", 30.0 * 0.8_f64.exp_m1()),
                ("bladder_stiffness.added_growth", 0.8),
                ("bladder_stiffness.added_curvature", 0.3),
            ],
        ),
        (
            "laid_rope",
            &[
                ("series_elasticity.compliance", -5e-6),
                ("series_elasticity.exponent", 0.0),
                ("series_elasticity.toe_force", 160.0),
            ],
        ),
        ("wrong_bore", &[("force_gain.relative_error", 0.08), ("force_gain.elastic_share", 0.5)]),
        (
            "stretching_threads",
            &[("force_gain.relative_error", 0.06), ("force_gain.bend", -0.02), ("force_gain.curvature", -0.012)],
        ),
        (
            "stiff_ends",
            &[
                ("end_effects.excess", 0.06),
                ("end_effects.low_pressure_excess", 0.1),
                ("end_effects.elastic_share", 0.25),
            ],
        ),
        ("counterweight", &[("payload_mass.additional_mass", -3.0), ("payload_mass.inertia", 6.0)]),
        ("chain", &[("payload_mass.per_length", 12.0)]),
        ("tapered_ends", &[("end_effects.taper", 0.18), ("end_effects.taper_length", 0.04)]),
        ("rope", &[("series_elasticity.load_compliance", 1.0 / 15e3)]),
        ("wire", &[("series_elasticity.load_compliance", 1.0 / 2e5)]),
        (
            "series_elasticity",
            &[
                ("series_elasticity.compliance", -8e-6),
                ("series_elasticity.exponent", 0.85),
                ("series_elasticity.toe_force", 25.0),
            ],
        ),
        (
            "threshold",
            &[
                ("threshold_pressure.lost", 0.4e5),
                ("threshold_pressure.lasting", 0.1e5),
                ("threshold_pressure.onset", 0.5e5),
                ("threshold_pressure.fade", 0.7e5),
                ("threshold_pressure.exponent", 1.5),
                ("threshold_pressure.decrease_with_contraction", 0.3),
                ("threshold_pressure.increase_with_pull", 0.2),
                ("threshold_pressure.wider_with_pull", 0.3),
            ],
        ),
        (
            "contact",
            &[
                ("threshold_pressure.contact", 0.4e5),
                ("threshold_pressure.contact_exponent", 2.4),
                ("threshold_pressure.decrease_with_contraction", 0.2),
            ],
        ),
        (
            "friction",
            &[
                ("friction_hysteresis.half_width", 12.0),
                ("friction_hysteresis.half_width_per_pressure", 6e-5),
                ("friction_hysteresis.presliding_displacement", 3e-3),
                ("friction_hysteresis.second_share", 0.3),
                ("friction_hysteresis.knee", 1.6),
                ("friction_hysteresis.unloading", 0.7),
                ("friction_hysteresis.stribeck_share", 0.2),
                ("friction_hysteresis.stribeck_velocity", 0.02),
                ("friction_hysteresis.start", 0.2),
            ],
        ),
        (
            "direct_friction",
            &[
                ("friction_hysteresis.half_width", 9.0),
                ("friction_hysteresis.half_width_per_pressure", 8e-5),
                ("friction_hysteresis.smoothing_velocity", 2e-3),
            ],
        ),
        (
            "sinking_friction",
            &[
                ("friction_hysteresis.half_width", 9.0),
                ("friction_hysteresis.half_width_per_pressure", 8e-5),
                ("friction_hysteresis.smoothing_velocity", 2e-3),
                ("friction_hysteresis.start", 0.4),
                ("friction_hysteresis.second_start", -1.0),
                ("friction_hysteresis.recording", 2.0),
            ],
        ),
        (
            "cord_friction",
            &[
                ("friction_hysteresis.half_width", 9.0),
                ("friction_hysteresis.half_width_per_pull", 0.04),
                ("friction_hysteresis.with_contraction", -0.6),
                ("friction_hysteresis.smoothing_velocity", 2e-3),
            ],
        ),
    ];
    for (name, effect) in cases {
        let (contraction, pressure) = differences("dmsp-40-1000", &format!("effect_{name}.csv"), effect);
        println!("{name}: contraction within {contraction:.1e} m, pressure within {pressure:.1e} Pa");
        assert!(contraction < 1e-7 && pressure < 0.1, "{name}: {contraction} m, {pressure} Pa");
    }
}

#[test]
fn the_zero_of_a_sensor_drifts_as_it_warms_up() {
    let mut parameters = Parameters::default();
    let [newtons, pascals, time_constant] = [-30.0, 4e3, 5.0];
    parameters.effects.temperature_drift.force_zero = newtons;
    parameters.effects.temperature_drift.pressure_zero = pascals;
    parameters.effects.temperature_drift.time_constant = time_constant;
    parameters.initial.gauge_pressure = 2e5;
    let mut muscle = Simulator::<PneumaticMuscle>::new(parameters);
    muscle.inputs.command = 2.0;
    muscle.initialize(0.0).unwrap();
    for step in 0..20 {
        let seconds = 2.0 * f64::from(step);
        let warm = 1.0 - (-seconds / time_constant).exp();
        let out = muscle.outputs();
        assert!((out.measured_force - out.force - newtons * warm).abs() < 1e-9, "{seconds} s");
        assert!((out.measured_gauge_pressure - out.gauge_pressure - pascals * warm).abs() < 1e-6, "{seconds} s");
        muscle.advance(2.0).unwrap();
    }
}

#[test]
fn eighty_kilograms_at_four_and_a_half_bar_contract_22_6_centimetres() {
    let long = Parameters::preset("dmsp-40-1000").unwrap();
    let contraction = equilibrium(&long, 4.5e5, 80.0 * GRAVITY).unwrap();
    assert!((contraction - 0.226).abs() < 5e-4, "{contraction}");
}

#[test]
fn the_short_muscle_contracts_5_7_to_6_8_centimetres() {
    let short = Parameters::preset("dmsp-40-290").unwrap();
    let at = |mass: f64| equilibrium(&short, 4.5e5, mass * GRAVITY).unwrap();
    assert!((at(80.0) - 0.057).abs() < 1e-3 && (at(10.0) - 0.068).abs() < 1e-3, "{} {}", at(80.0), at(10.0));
}

#[test]
fn mckibben_area_is_the_change_of_volume() {
    for preset in ["dmsp-40-1000/improved-mckibben", "dmsp-40-290/improved-mckibben"] {
        let Parameters { muscle, force_models, .. } = Parameters::preset(preset).unwrap();
        for k in 1..20 {
            let (x, h) = (muscle.rest_length * 0.012 * f64::from(k), 1e-5 * muscle.rest_length);
            // x = L0 - L, hence dx = -dL.
            let difference = (muscle.volume(x + h) - muscle.volume(x - h)) / (2.0 * h);
            let area = force_models.virtual_area(&muscle, 1e5, x);
            assert!((area - difference).abs() < 1e-7 * area.abs().max(1e-3), "{preset} at {x}: {area} {difference}");
        }
    }
}

#[test]
fn improved_mckibben_reproduces_the_thesis_forces_as_well_as_it_can() {
    // Forces of the virtual-area model at 1 to 4.5 bar, 90 to 820 N; plain McKibben is the area term alone.
    let rms = |values: &[f64]| (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt();
    for (preset, reach, improved_bar, plain_about) in
        [("dmsp-40-1000", 0.24, 50.0, 695.0), ("dmsp-40-290", 0.071, 76.0, 978.0)]
    {
        let virtual_area = Parameters::preset(preset).unwrap();
        let mckibben = Parameters::preset(&format!("{preset}/improved-mckibben")).unwrap();
        let (mut improved, mut plain) = (Vec::new(), Vec::new());
        for bar in 2..=9 {
            for k in 0..40 {
                let (pressure, x) = (0.5e5 * f64::from(bar), reach * f64::from(k) / 39.0);
                let wanted = virtual_area.force_models.force(&virtual_area.muscle, pressure, x);
                if (90.0..820.0).contains(&wanted) {
                    improved.push(mckibben.force_models.force(&mckibben.muscle, pressure, x) - wanted);
                    plain.push(pressure * mckibben.force_models.virtual_area(&mckibben.muscle, pressure, x) - wanted);
                }
            }
        }
        let (improved, plain) = (rms(&improved), rms(&plain));
        println!("{preset}: improved {improved:.1} N, plain {plain:.1} N");
        assert!(improved < improved_bar && (plain - plain_about).abs() < 1.0, "{preset}: {improved} {plain}");
    }
}

#[test]
fn the_load_balances_its_energy() {
    // Work of the muscle's pull = gain of potential and kinetic energy.
    let mut parameters = Parameters::default();
    parameters.load.mass = 40.0;
    parameters.initial.gauge_pressure = 1.5e5;
    let mut muscle = Simulator::<PneumaticMuscle>::new(parameters);
    muscle.initialize(0.0).unwrap();
    muscle.inputs.command = 2.5;
    let start = muscle.outputs();
    let (mut work, mut before, step) = (0.0, start, 1e-4);
    for _ in 0..20_000 {
        muscle.advance(step).unwrap();
        let now = muscle.outputs();
        let power = |out: &sinew::plant::MuscleOutputs| out.force * out.contraction_velocity;
        work += 0.5 * step * (power(&before) + power(&now));
        before = now;
    }
    let potential = 40.0 * GRAVITY * (before.contraction - start.contraction);
    let kinetic = 20.0 * before.contraction_velocity.powi(2);
    assert!(potential > 10.0, "the load must have moved");
    assert!((work - potential - kinetic).abs() < 1e-4 * work, "{work} {potential} {kinetic}");
}

#[test]
fn closed_loop_with_the_printed_gains_errs_as_an_independent_simulation_does() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/closed_loop.csv");
    let mut checked = 0;
    for row in csv::Reader::from_path(path).unwrap().records() {
        let row = row.unwrap();
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        if &row[0] != "static" {
            continue;
        }
        let mut parameters = Parameters::preset("dmsp-40-1000/improved-mckibben/thesis").unwrap();
        parameters.muscle.damping = 50.0;
        parameters.valve.bandwidth = if &row[1] == "2.5 Hz" { 2.5 * std::f64::consts::TAU } else { 2.5 };
        (parameters.load.mass, parameters.reference.velocity) = (number(2), number(3));
        let run = closed_loop(&parameters, 1e-3, parameters.reference.duration() + 2.0).unwrap();
        let (ours, theirs) = (1e3 * run.largest_error(), 1e3 * number(4));
        println!("valve {}, {} kg, {} m/s: {ours:.3} mm, independent {theirs:.3} mm", &row[1], &row[2], &row[3]);
        assert!((ours - theirs).abs() < 0.2 * theirs);
        checked += 1;
    }
    assert_eq!(checked, 18);
}

#[test]
fn default_gains_leave_a_margin_on_the_linearised_plant() {
    use nalgebra::Complex;
    let mut worst = 0.0_f64;
    for preset in ["dmsp-40-1000", "dmsp-40-290"] {
        let Parameters { muscle, force_models, valve, controller: pid, .. } = Parameters::preset(preset).unwrap();
        for mass in [20.0, 40.0, 80.0] {
            for tenth in 0..=10 {
                let x = 0.02 * f64::from(tenth) * muscle.rest_length;
                let area = force_models.virtual_area(&muscle, 1e5, x);
                let pressure = (mass * GRAVITY - force_models.elastic_force(&muscle, x)) / area;
                let force = |x: f64| force_models.force(&muscle, pressure, x);
                let stiffness = (force(x - 1e-6) - force(x + 1e-6)) / 2e-6;
                for k in 0..2000 {
                    let s = Complex::new(0.0, 10.0_f64.powf(-2.0 + 5.0 * f64::from(k) / 2000.0));
                    let motion = s * s * mass + s * muscle.damping + stiffness;
                    let plant = (s / valve.bandwidth + 1.0).inv() * (valve.gain * area) / motion;
                    let derivative = s * pid.derivative_gain / (s * pid.filter_time_constant + 1.0);
                    let controller = s.inv() * pid.integral_gain + pid.proportional_gain + derivative;
                    worst = worst.max((plant * controller + 1.0).inv().norm());
                }
                assert!(stiffness > 0.0, "an unstable plant would need another criterion");
            }
        }
    }
    println!("largest sensitivity {worst:.2}");
    assert!(worst < 1.8, "{worst}");
}

#[test]
fn the_closed_loop_with_default_gains_settles() {
    for preset in ["dmsp-40-1000", "dmsp-40-290"] {
        for mass in [20.0, 40.0, 80.0] {
            let mut parameters = Parameters::preset(preset).unwrap();
            parameters.load.mass = mass;
            parameters.reference.target = 0.15 * parameters.muscle.rest_length;
            let run = closed_loop(&parameters, 1e-3, parameters.reference.duration() + 5.0).unwrap();
            let left = run.control_error.last().unwrap().abs();
            println!(
                "{preset}, {mass} kg: largest error {:.2} mm, left {:.4} mm",
                1e3 * run.largest_error(),
                1e3 * left
            );
            assert!(run.largest_error() < 2e-3 && left < 1e-5);
        }
    }
}
