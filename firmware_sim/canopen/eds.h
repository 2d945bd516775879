#pragma once

#include <string>

/// @file
/// The electronic data sheet of the drive (CiA 306): every row of object_table.h in the INI format
/// that CANopen configuration tools read. $NODEID stands where a default depends on the node id.

namespace mantle::firmware_sim {

std::string MakeEds();

}  // namespace mantle::firmware_sim
