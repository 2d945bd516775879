// A constant strain in two segments, two of six strains each, gives four coordinates.
#include "reduced/strain_basis.h"

int main() {
  using namespace mantle;
  reduced::ArmReduction reduction;
  reduction.segments = 2;
  reduction.strains = reduced::kBending;
  return reduced::StrainBasis(reduction, 0.4).size() == 4 ? 0 : 1;
}
