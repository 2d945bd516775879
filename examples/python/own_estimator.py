# An estimator of one's own in the closed loop of a scene with noise: it follows the measurements with a
# constant gain.
#
# Prints: ^mine: worst strain error [0-9.]+ 1/m

import mantle


class Follower:
    GAIN = 0.3

    def __init__(self, parts):
        self.model = parts.model

    def start(self, state):
        self.state = state

    def update(self, time_s, tensions, measured):
        if measured is not None:
            self.state = self.model.move(self.state, self.GAIN * self.model.difference(self.state, measured))
        return self.state


errors = []
mantle.closed_loop(mantle.scene_folder() / "reach_noise.toml", {"time.duration": 1}, controller="pid",
                   estimator=Follower, observer=lambda step: errors.append(abs(step.estimate.q - step.truth.q).max()))
print(f"mine: worst strain error {max(errors):.3f} 1/m")
