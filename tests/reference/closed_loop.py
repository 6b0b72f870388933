"""Independent simulation of the position loop: printed PID gains and feed-forward on the improved McKibben muscle.

Two feed-forwards: "static" commands the pressure that holds the load still at the setpoint; "inverting" commands
the pressure that also accelerates the load, and leads it by the valve's lag.

Everything is continuous in time: the derivative acts on the error (setpoint velocity minus muscle velocity), without
a filter, and the loop starts in static equilibrium at zero contraction with an empty integrator.
"""

from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from muscles import GRAVITY, IMPROVED_1000, static_force

PROPORTIONAL, INTEGRAL, DERIVATIVE = 0.043, 0.00040575, 1.1398
MUSCLE, DAMPING, VALVE_GAIN = IMPROVED_1000, 50.0, 1e5
STROKE, ACCELERATION = 0.15, 0.05
SETTLING_TIME = 2.0
BANDWIDTHS = {"2.5 rad/s": 2.5, "2.5 Hz": 2 * np.pi * 2.5}
CONTROLLERS = ("static", "2.5 rad/s"), ("static", "2.5 Hz"), ("inverting", "2.5 Hz")
MASSES = 20.0, 40.0, 80.0
VELOCITIES = 0.01, 0.03, 0.05


def profile(velocity):
    """Corner times of the trapezoidal velocity profile, and the acceleration that follows each."""
    ramp_time = velocity / ACCELERATION
    cruise_end = STROKE / velocity
    corners = np.array([0.0, ramp_time, cruise_end, cruise_end + ramp_time, cruise_end + ramp_time + SETTLING_TIME])
    return corners, (ACCELERATION, 0.0, -ACCELERATION, 0.0)


def holding_pressure(setpoint, mass, acceleration=0.0):
    return (mass * (GRAVITY + acceleration) - MUSCLE.elastic_force(setpoint)) / MUSCLE.area(setpoint)


def static_command(setpoint, velocity, acceleration, mass, bandwidth):
    return holding_pressure(setpoint, mass) / VALVE_GAIN


def inverting_command(setpoint, velocity, acceleration, mass, bandwidth):
    """Jumps of the acceleration would ask for an impulse; they are left to the feedback."""
    tiny = 1e-20  # complex step: the derivative to the last digit
    slope = holding_pressure(setpoint + 1j * tiny, mass, acceleration).imag / tiny
    return (holding_pressure(setpoint, mass, acceleration) + slope * velocity / bandwidth) / VALVE_GAIN


FEED_FORWARDS = {"static": static_command, "inverting": inverting_command}


def max_error(feed_forward, bandwidth, mass, velocity):
    corners, accelerations = profile(velocity)

    def derivative(t, state, acceleration):
        pressure, x, x_velocity, integral, setpoint, setpoint_velocity = state
        error = setpoint - x
        command = (feed_forward(setpoint, setpoint_velocity, acceleration, mass, bandwidth)
                   + PROPORTIONAL * error + INTEGRAL * integral + DERIVATIVE * (setpoint_velocity - x_velocity))
        force = static_force(MUSCLE, pressure, x) - DAMPING * x_velocity
        return [bandwidth * (VALVE_GAIN * command - pressure), x_velocity, force / mass - GRAVITY,
                error, setpoint_velocity, acceleration]

    state = [holding_pressure(0.0, mass), 0.0, 0.0, 0.0, 0.0, 0.0]
    largest = 0.0
    for start, end, acceleration in zip(corners[:-1], corners[1:], accelerations):
        piece = solve_ivp(derivative, (start, end), state, "DOP853", args=(acceleration,), max_step=0.01,
                          rtol=1e-9, atol=[1e-3, 1e-11, 1e-11, 1e-11, 1e-14, 1e-14])
        largest = max(largest, np.abs(piece.y[4] - piece.y[1]).max())
        state = piece.y[:, -1]
    return largest


def print_table(errors):
    print("max error [mm]                 " + "".join(f"{velocity:>8g} m/s" for velocity in VELOCITIES))
    for controller in CONTROLLERS:
        table = 1e3 * np.array([[errors[*controller, mass, velocity] for velocity in VELOCITIES] for mass in MASSES])
        for label, row in zip([f"{mass:g} kg" for mass in MASSES] + ["worst"], [*table, table.max(axis=0)]):
            print(f"{controller[0]:10}{controller[1]:>10}{label:>10} " + "".join(f"{value:12.4f}" for value in row))


def main():
    errors = {(name, valve, mass, velocity): max_error(FEED_FORWARDS[name], BANDWIDTHS[valve], mass, velocity)
              for name, valve in CONTROLLERS for mass in MASSES for velocity in VELOCITIES}
    with open(Path(__file__).with_suffix(".csv"), "w") as file:
        file.write("feed_forward,valve,load_mass [kg],velocity [m/s],max_error [m]\n")
        file.writelines(f"{name},{valve},{mass:g},{velocity:g},{error:.7g}\n"
                        for (name, valve, mass, velocity), error in errors.items())
    print_table(errors)


if __name__ == "__main__":
    main()
