// The electronic data sheet of the drive names its statusword.
#include "firmware_sim/canopen/eds.h"

int main() { return mantle::firmware_sim::MakeEds().find("[6041]") == std::string::npos ? 1 : 0; }
