#pragma once

#include <vector>

#include "firmware_sim/drive/drive.h"
#include "loop/options.h"
#include "model/plant.h"
#include "reduced/reduction.h"

namespace mantle::loop {

/// One cable of a Reel: which it is, and its share of the law.
struct ReeledCable {
  int index{0};                               ///< into PlantInputs::cables
  double gain{1};                             ///< g_j
  double rest_length_m{0};                    ///< l_j(0)
  double stiffness_n_m{0}, damping_n_s_m{0};  ///< k_j, d_j
};

/// Of the drum: reeled length since the slack was gone, and rate.
struct ReelState {
  double reeled_m{0}, rate_m_s{0};  ///< r, positive inwards
};

/// One motor's cables between drum and plant ([physics.md] 2, last paragraphs). With r what the
/// drum has reeled in since the slack was gone, g_j the gain of cable j, l_j its length:
///
///   u_j = max(0, k_j e_j + d_j e_j_dot),   e_j = l_j - l_j(0) + g_j r
///   drum load T = sum g_j u_j,   stiffness at the drum K = sum g_j^2 k_j = K, k_j = K / G,
///   G = sum g_j^2;  damping alike
///
/// With all of them taut T = K e + D e_dot, where e = lambda - lambda(0) + r and
/// lambda = sum g_j l_j / G is the motor's length; and T = G u where u_j = g_j u.
///
/// The plant evaluates the law inside its implicit step, with r(t) given over the coupling step as
/// the cubic through the drum's reeled lengths and rates at its ends; the drum evaluates it about
/// the plant's last lengths, which run on at their last rates.
struct Reel {
  std::vector<ReeledCable> cables;
  double gain_square{1};    ///< G
  double rest_length_m{0};  ///< lambda(0)
  // The coupling step: r(t) between its ends.
  double begin_s{0}, end_s{0};  ///< from t = 0
  ReelState begin, end;         ///< at those times
};

/// `work` of the plant at t = 0 gives the lengths at rest. Throws std::invalid_argument, naming the
/// motor, where a target is no cable, a gain is not above 0 or a cable does not exist.
Reel MakeReel(const model::Plant& plant, const reduced::Actuator& motor,
              const DriveOptions& options, const model::PlantWork& work);

/// r(t), constant outside the coupling step.
ReelState ReelAt(const Reel& reel, double t_s);

/// Writes the motor's cables as reeled inputs at time t.
void SetCables(const Reel& reel, double t_s, model::PlantInputs* inputs);

/// lambda and its rate; T.
double ReelLength(const Reel& reel, const std::vector<double>& cable_lengths_m);
double DrumTension(const Reel& reel, const std::vector<double>& cable_tensions_n);

/// Energy in the cables' stretch [J] at the end of the coupling step.
double StoredEnergy(const Reel& reel, const model::PlantWork& work);

/// The law as the drum of `drum` feels it about the plant's lengths and rates in `work`;
/// `slack_m` is what the drum had to reel in until the slack was gone.
firmware_sim::CableLoad LoadOnDrum(const Reel& reel, const model::PlantWork& work, double slack_m);

}  // namespace mantle::loop
