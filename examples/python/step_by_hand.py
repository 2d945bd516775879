# The plant stepped by hand: a cable is pulled, and the arm's bending looked at as it grows.
#
# Prints: ^t = 0\.50 s: largest curvature [0-9.]+ 1/m

import mantle

simulation = mantle.Simulation(mantle.load(mantle.scene_folder() / "reach.toml"))
simulation.set_tension("arm.a", 0.3)
bending = simulation.shape.arms["arm"].strain[:, 1:3]  # a view: it follows the simulation
for k in range(1, 6):
    simulation.advance_to(0.1 * k)
    print(f"t = {simulation.time_s:.2f} s: largest curvature {abs(bending).max():.3f} 1/m")
