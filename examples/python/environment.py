# The closed loop as an environment: a random search for the gain of a proportional law, over seeds.
#
# Prints: ^best gain [0-9.]+ N/m, return -[0-9.]+

import numpy

import mantle

env = mantle.Env(mantle.scene_folder() / "reach_noise.toml", {"time.duration": 1})
model = mantle.ReducedModel(env.scene)
ways = numpy.array([[1, 0, -1, 0], [0, 1, 0, -1]])  # cables a to d stand 90 degrees apart


def episode(gain, seed):
    _, info = env.reset(seed=seed)
    total, over = 0.0, False
    while not over:
        tip = model.tip(info["estimate"])[0]
        pull = gain * (numpy.array([0.105, 0.0]) - [-tip[0], tip[1]])
        _, reward, terminated, truncated, info = env.step(numpy.clip(ways.T @ pull, 0, 1))
        total, over = total + reward, terminated or truncated
    return total


random = numpy.random.default_rng(1)
gains = random.uniform(0, 6, size=4)
returns = [episode(gain, seed) for seed, gain in enumerate(gains)]
print(f"best gain {gains[numpy.argmax(returns)]:.2f} N/m, return {max(returns):.2f}")
