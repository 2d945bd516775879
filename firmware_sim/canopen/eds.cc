#include "firmware_sim/canopen/eds.h"

#include <fmt/format.h>

#include <string_view>
#include <vector>

#include "firmware_sim/canopen/object_dictionary.h"

namespace mantle::firmware_sim {
namespace {

constexpr int kVar = 0x7;
constexpr int kArray = 0x8;
constexpr int kRecord = 0x9;

/// Object types of CiA 301 table 42; records are the indices whose sub-indices differ in meaning.
int ObjectType(std::uint16_t index) {
  switch (index) {
    case object::kErrorHistory:
    case object::kConsumerHeartbeat:
    case object::kErrorBehaviour:
    case object::kPositionLimits:
      return kArray;
    default:
      return kRecord;
  }
}

std::string_view RecordName(std::uint16_t index) {
  switch (index) {
    case object::kErrorHistory:
      return "Pre-defined error field";
    case object::kConsumerHeartbeat:
      return "Consumer heartbeat time";
    case object::kIdentity:
      return "Identity object";
    case object::kErrorBehaviour:
      return "Error behaviour";
    case object::kRpdo1:
      return "RPDO1 communication parameter";
    case object::kRpdo2:
      return "RPDO2 communication parameter";
    case object::kRpdo1Mapping:
      return "RPDO1 mapping parameter";
    case object::kRpdo2Mapping:
      return "RPDO2 mapping parameter";
    case object::kTpdo1:
      return "TPDO1 communication parameter";
    case object::kTpdo2:
      return "TPDO2 communication parameter";
    case object::kTpdo1Mapping:
      return "TPDO1 mapping parameter";
    case object::kTpdo2Mapping:
      return "TPDO2 mapping parameter";
    case object::kPositionLimits:
      return "Software position limit";
    case object::kEncoderResolution:
      return "Position encoder resolution";
    case object::kGearRatio:
      return "Gear ratio";
    case object::kFeedConstant:
      return "Feed constant";
    default:
      return "Interpolation time period";
  }
}

std::string_view AccessName(const ObjectEntry& row) {
  switch (row.access) {
    case Access::kConst:
      return "const";
    case Access::kReadOnly:
      return "ro";
    case Access::kWriteOnly:
      return "wo";
    case Access::kReadWrite:
      return row.mappable == Mappable::kReceive ? "rww" : "rw";
  }
  return "";
}

std::string Number(const ObjectEntry& row, std::int64_t value) {
  if (IsSigned(row.type)) return fmt::format("{}", value);
  return fmt::format("0x{:0{}X}", value, 2 * ByteSize(row.type));
}

std::string Default(const ObjectEntry& row) {
  if (row.type == DataType::kString) {
    std::string text;
    for (unsigned i = 0; i < ByteSize(row.type); ++i) {
      text += static_cast<char>(static_cast<std::uint64_t>(row.initial) >> 8U * i & 0xFFU);
    }
    return text;
  }
  return (row.plus_node ? "$NODEID+" : "") + Number(row, row.initial);
}

std::string Entry(const ObjectEntry& row) {
  std::string text = fmt::format(
      "ParameterName={}\nObjectType=0x{:X}\nDataType=0x{:04X}\nAccessType={}\nDefaultValue={}\n"
      "PDOMapping={}\n",
      row.name, kVar, static_cast<int>(row.type), AccessName(row), Default(row),
      row.mappable == Mappable::kNo ? 0 : 1);
  const std::int64_t span = std::int64_t{1} << 8 * ByteSize(row.type);
  const bool is_full = row.high - row.low == span - 1;
  if (row.type != DataType::kString && !is_full && row.access != Access::kConst) {
    text += fmt::format("LowLimit={}\nHighLimit={}\n", Number(row, row.low), Number(row, row.high));
  }
  return text + "\n";
}

struct IndexRange {
  std::size_t first;
  std::size_t count;
};

/// Rows of each index.
std::vector<IndexRange> Ranges() {
  std::vector<IndexRange> ranges;
  for (std::size_t i = 0; i < kObjectTable.size(); ++i) {
    if (i == 0 || kObjectTable[i].index != kObjectTable[i - 1].index) ranges.push_back({i, 0});
    ++ranges.back().count;
  }
  return ranges;
}

std::string ObjectList(std::string_view name, const std::vector<std::uint16_t>& indices) {
  std::string text = fmt::format("[{}]\nSupportedObjects={}\n", name, indices.size());
  for (std::size_t i = 0; i < indices.size(); ++i) {
    text += fmt::format("{}=0x{:04X}\n", i + 1, indices[i]);
  }
  return text + "\n";
}

constexpr std::string_view kHeader = R"([FileInfo]
FileName=mantle_drive.eds
FileVersion=1
FileRevision=0
EDSVersion=4.0
Description=Simulated winch drive, CiA 402, cyclic synchronous modes
CreationTime=12:00AM
CreationDate=01-01-2026
CreatedBy=Mantle
ModificationTime=12:00AM
ModificationDate=01-01-2026
ModifiedBy=Mantle

[DeviceInfo]
VendorName=Mantle
VendorNumber=0x00000000
ProductName=Mantle drive
ProductNumber=0x00000402
RevisionNumber=0x00010000
OrderCode=MDRV
BaudRate_10=0
BaudRate_20=0
BaudRate_50=0
BaudRate_125=0
BaudRate_250=0
BaudRate_500=0
BaudRate_800=0
BaudRate_1000=1
SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=8
DynamicChannelsSupported=0
CompactPDO=0
GroupMessaging=0
NrOfRXPDO=2
NrOfTXPDO=2
LSS_Supported=0

[DummyUsage]
Dummy0001=0
Dummy0002=0
Dummy0003=0
Dummy0004=0
Dummy0005=0
Dummy0006=0
Dummy0007=0

[Comments]
Lines=0

)";

}  // namespace

std::string MakeEds() {
  std::vector<std::uint16_t> mandatory;
  std::vector<std::uint16_t> manufacturer;
  std::vector<std::uint16_t> optional;
  std::string objects;
  for (const IndexRange& range : Ranges()) {
    const ObjectEntry& first = kObjectTable[range.first];
    const std::uint16_t index = first.index;
    if (index == 0x1000 || index == 0x1001 || index == 0x1018) {
      mandatory.push_back(index);
    } else if (index >= 0x2000 && index < 0x6000) {
      manufacturer.push_back(index);
    } else {
      optional.push_back(index);
    }
    if (range.count == 1) {
      objects += fmt::format("[{:04X}]\n", index) + Entry(first);
      continue;
    }
    objects += fmt::format("[{:04X}]\nParameterName={}\nObjectType=0x{:X}\nSubNumber={}\n\n", index,
                           RecordName(index), ObjectType(index), range.count);
    for (std::size_t i = 0; i < range.count; ++i) {
      const ObjectEntry& row = kObjectTable[range.first + i];
      objects += fmt::format("[{:04X}sub{:X}]\n", index, row.sub) + Entry(row);
    }
  }
  return std::string(kHeader) + ObjectList("MandatoryObjects", mandatory) +
         ObjectList("OptionalObjects", optional) + ObjectList("ManufacturerObjects", manufacturer) +
         objects;
}

}  // namespace mantle::firmware_sim
