# A controller of one's own in the closed loop of a scene: it pulls the tip of the arm towards its
# reference as a spring and a damper would.
#
# Prints: ^mine: mean error [0-9.]+ mm over 3\.0 s

import numpy

import mantle


class TipSpring:
    BIAS_N, STIFFNESS_N_M, DAMPING_N_S_M = 0.02, 4.0, 0.3

    def __init__(self, parts):
        self.reference = parts.reference
        self.directions = parts.pull_directions

    def command(self, time_s, estimate, tensions):
        tensions[:] = self.BIAS_N
        if estimate is None:
            return
        error, rate = self.reference.aim(estimate)
        pull = self.STIFFNESS_N_M * error + self.DAMPING_N_S_M * rate
        tensions += numpy.maximum(0, self.directions.T @ pull)


if __name__ == "__main__":
    loop = mantle.closed_loop(mantle.scene_folder() / "reach.toml", {"time.duration": 3}, controller=TipSpring)
    print(f"mine: mean error {1e3 * loop['control']['error']['mean']:.1f} mm over {loop['sim_time_s']:.1f} s")
