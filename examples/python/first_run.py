# A scene in time, and its results as arrays.
#
# Prints: ^arm_dynamic: [0-9]+ samples, the tip moves by [0-9.]+ mm

import mantle

results = mantle.run(mantle.scene_folder() / "arm_dynamic.toml", {"time.duration": 0.5})
path = results.trajectory.matrix("arm_tip_x_m", "arm_tip_y_m", "arm_tip_z_m")
moved = max(sum((path - path[0]).T ** 2) ** 0.5)
print(f"{results['scene']}: {len(path)} samples, the tip moves by {1e3 * moved:.1f} mm")
