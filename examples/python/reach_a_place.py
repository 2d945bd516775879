# Exact derivatives at work: Gauss-Newton steps find the tensions that bring an arm's tip to a place at
# 1 s, through the derivatives of the reduced model's step.
#
# Prints: ^step 4: the tip is [0-9.e-]+ mm away

import numpy

import mantle

model = mantle.ReducedModel(mantle.load(mantle.scene_folder() / "reach.toml"))
place = model.tip(model.step(model.state(), 1.0, [0.25, 0.15, 0.0, 0.0]))[0]  # one that can be reached
tensions = numpy.full(4, 0.1)
for k in range(5):
    end, _, by_tension = model.step(model.state(), 1.0, tensions, jacobian=True)
    tip, by_state = model.tip(end)
    print(f"step {k}: the tip is {1e3 * numpy.linalg.norm(place - tip):.3g} mm away")
    slope = by_state @ by_tension[: model.velocity_count]
    tensions = tensions + numpy.linalg.lstsq(slope, place - tip, rcond=1e-2)[0]
