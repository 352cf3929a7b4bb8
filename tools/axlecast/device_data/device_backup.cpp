#include "tools/axlecast/device_data/device_backup.h"

#include <sodium.h>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/base/result.h"
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/device/operation.h"
#include "core/device/parameter.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/device_data/device_access.h"
#include "tools/axlecast/device_data/parameters.h"

namespace axlecast {
namespace {

constexpr std::string_view kReadMemory = "eeprom_backup";
constexpr std::string_view kReadParameters = "read_parameters";

using Json = nlohmann::ordered_json;

constexpr const char* kVersionKey = "axlecast_backup";
constexpr const char* kSumKey = "sha256";
constexpr std::size_t kRow = 16;  // cells per line

std::string Sha256(std::string_view text) {
  std::array<std::uint8_t, crypto_hash_sha256_BYTES> sum{};
  crypto_hash_sha256(sum.data(), reinterpret_cast<const unsigned char*>(text.data()), text.size());
  return HexDigits(sum);
}

// Texts of a device were made printable before: all bytes are UTF-8.
std::string Compact(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json MemoryJson(const MemoryCells& cells) {
  Json json = Json::object();
  std::vector<std::uint8_t> row;
  std::size_t begin = 0;
  const auto end_row = [&] {
    if (!row.empty()) json["eeprom_" + std::to_string(begin)] = HexText(row);
    row.clear();
  };
  for (const auto& [address, byte] : cells) {
    if (row.size() == kRow || address != begin + row.size()) end_row();
    if (row.empty()) begin = address;
    row.push_back(byte);
  }
  end_row();
  return json;
}

Json DatumJson(const device_info_t& info) {
  return {{"counts", info.datum_counts},
          {"utime", info.datum_utime},
          {"epoch", info.datum_epoch},
          {"reference_lost", info.reference_lost != 0}};
}

// Reads the members of an object. Keeps the first error: a member is missing or has another type.
class Reader {
 public:
  explicit Reader(const Json& json) : json_(json) {}

  [[nodiscard]] const Result<>& status() const { return status_; }

  std::string Text(const char* key) {
    const Json* member = Member(key, Json::value_t::string, "a text");
    return member == nullptr ? "" : member->get<std::string>();
  }
  std::int64_t Integer(const char* key, std::int64_t fallback) {
    const auto found = json_.find(key);
    if (found != json_.end() && found->is_null()) return fallback;
    const bool fits = found != json_.end() && found->is_number_integer() &&
                      (!found->is_number_unsigned() ||
                       found->get<std::uint64_t>() <= std::uint64_t{std::numeric_limits<std::int64_t>::max()});
    if (fits) return found->get<std::int64_t>();
    SetError(key, "a whole number");
    return fallback;
  }
  // Reads a member that is an object of texts.
  std::map<std::string, std::string> Texts(const char* key) {
    std::map<std::string, std::string> texts;
    const Json* member = Member(key, Json::value_t::object, "an object of texts");
    if (member == nullptr) return texts;
    for (const auto& [name, value] : member->items()) {
      if (!value.is_string()) return SetError(key, "an object of texts"), texts;
      texts[name] = value.get<std::string>();
    }
    return texts;
  }
  Json Any(const char* key) { return json_.value(key, Json()); }

 private:
  const Json* Member(const char* key, Json::value_t type, const char* what) {
    const auto found = json_.find(key);
    if (found != json_.end() && found->type() == type) return &*found;
    SetError(key, what);
    return nullptr;
  }
  void SetError(const char* key, const char* what) {
    if (status_) status_ = Failure(std::string(key) + " is missing or not " + what);
  }

  const Json& json_;
  Result<> status_;
};

// Fails if the object is not a backup, or has another version or a wrong checksum.
Result<> CheckForm(Json json) {
  if (json.is_discarded()) return Failure("it is not JSON: it was damaged, or is another file");
  if (!json.is_object() || !json.contains(kVersionKey)) {
    return Failure("it is no backup of axlecast (axlecast backup DEVICE)");
  }
  const Json version = json[kVersionKey];
  if (version != kBackupVersion) {
    return Failure("its version is " + Printable(Compact(version)) + ", and this axlecast reads version " +
                   std::to_string(kBackupVersion) + ": read it with the axlecast that wrote it");
  }
  const Json sum = json.value(kSumKey, Json());
  json.erase(kSumKey);
  if (sum == Sha256(Compact(json))) return {};
  return Failure("its content does not match its sha256: it was damaged or changed; use another copy");
}

Result<MemoryCells> CellsIn(const std::map<std::string, std::string>& memory) {
  std::vector<change_t> changes;
  for (const auto& [key, bytes] : memory) {
    if (!key.starts_with("eeprom_")) {
      return Failure("memory: " + Quoted(Printable(key)) + " is no eeprom_ADDRESS");
    }
    changes.push_back({key, "", bytes});
  }
  if (changes.empty()) return MemoryCells();
  return CellsOf(changes);
}

}  // namespace

const OperationSpec* BackupOperation(const Family& family) {
  const auto found =
      std::find_if(family.operations.begin(), family.operations.end(), [](const OperationSpec& operation) {
        return operation.reads_only && (operation.name == kReadMemory || operation.name == kReadParameters);
      });
  return found == family.operations.end() ? nullptr : &*found;
}

BackupReading ReadContents(OperatorClient& client, const Family& family, const CommandOptions& options) {
  BackupReading reading;
  if (BackupOperation(family)->name == kReadParameters) {
    ParameterReading read = ReadParameters(client, family, options);
    reading.result = std::move(read.result);
    if (!read.values) {
      reading.contents = Failure(read.values.error());
      return reading;
    }
    reading.text = ParameterFileText(family, options.device, *read.values);
    reading.contents->values = *std::move(read.values);
    return reading;
  }
  reading.result = client.Execute({.device = options.device,
                                   .operation = std::string(kReadMemory),
                                   .valid_ms = options.valid_ms,
                                   .reason = options.reason});
  if (ExitCode(reading.result) != kExitDone) return reading;
  reading.contents = CellsOf(reading.result.status.changes).map([](MemoryCells cells) {
    return BackupContents{.cells = std::move(cells), .values = {}};
  });
  reading.text = MemoryFileText(reading.result);
  return reading;
}

int Check(const BackupReading& reading, const std::string& prefix) {
  if (ExitCode(reading.result) != kExitDone) return PrintOutcome(reading.result);
  return reading.contents ? kExitDone : Fail(prefix + reading.contents.error().text, kExitFailed);
}

Result<ContentsFile> ParseContents(const Family& family, const std::string& file, const std::string& text) {
  const OperationSpec* operation = BackupOperation(family);
  if (operation == nullptr) {
    return Failure("devices of " + std::string(family.name) + " store nothing that can be backed up");
  }
  if (operation->name == kReadParameters) {
    ConfigErrors errors(file);
    ContentsFile parsed{.contents = {.cells = {}, .values = ParseParameterFile(family, text, errors)},
                        .device = ""};
    if (!errors.empty()) return Failure(errors.Text());
    return parsed;
  }
  Result<MemoryFile> memory = ParseMemoryFile(text);
  if (!memory) return Failure(file + ": " + memory.error().text);
  return ContentsFile{.contents = {.cells = std::move(memory->cells), .values = {}}, .device = memory->device};
}

std::string BackupFileName(const std::string& device, std::int64_t unix_us, const std::string& ending) {
  std::string time;
  for (const char c : UtcText(unix_us)) {
    if (c == ' ') time += 'T';
    if (c >= '0' && c <= '9') time += c;
  }
  return device + '-' + time + 'Z' + ending;
}

DeviceBackup MakeBackup(const MachineView& machine, const DeviceView& device, const Family& family,
                        const BackupContents& contents) {
  const device_info_t& info = *device.info;
  DeviceBackup backup{.machine = machine.machine(),
                      .device = device.name,
                      .bus = device.bus,
                      .family = std::string(family.name),
                      .model = Printable(info.model),
                      .identity = info.identity,
                      .serial = Printable(info.serial),
                      .firmware = Printable(info.firmware),
                      .cells = contents.cells};
  for (const ParameterValue& value : contents.values) {
    backup.parameters[std::string(value.parameter->name)] = ParameterText(*value.parameter, value.raw);
  }
  if (family.has_position) backup.datum = DatumJson(info);
  for (const alarm_entry_t& alarm : device.alarms.entries()) backup.alarms.push_back(ToJson(alarm));
  return backup;
}

std::string ToFileText(const DeviceBackup& backup) {
  Json json = {{kVersionKey, kBackupVersion},
               {"machine", backup.machine},
               {"device", backup.device},
               {"bus", backup.bus},
               {"family", backup.family},
               {"model", backup.model},
               {"identity", backup.identity < 0 ? Json() : Json(backup.identity)},
               {"serial", backup.serial},
               {"firmware", backup.firmware},
               {"utime", backup.unix_us},
               {"time", UtcText(backup.unix_us) + " UTC"},
               {"written_by", backup.written_by},
               {"memory", MemoryJson(backup.cells)},
               {"parameters", Json::object()},
               {"datum", backup.datum},
               {"alarms", backup.alarms}};
  for (const auto& [name, value] : backup.parameters) json["parameters"][name] = value;
  json[kSumKey] = Sha256(Compact(json));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

Result<DeviceBackup> ParseDeviceBackup(std::string_view text) {
  if (text.size() > kMaxBackupBytes) {
    return Failure("it is longer than " + std::to_string(kMaxBackupBytes) + " bytes: no backup of a device is");
  }
  const Json json = ParseOutsideJson(text);
  if (const auto form = CheckForm(json); !form) return Failure(form.error());
  Reader reader(json);
  DeviceBackup backup;
  backup.machine = reader.Text("machine");
  backup.device = reader.Text("device");
  backup.bus = reader.Text("bus");
  backup.family = reader.Text("family");
  backup.model = reader.Text("model");
  backup.identity = reader.Integer("identity", -1);
  backup.serial = reader.Text("serial");
  backup.firmware = reader.Text("firmware");
  backup.unix_us = reader.Integer("utime", 0);
  backup.written_by = reader.Text("written_by");
  backup.parameters = reader.Texts("parameters");
  backup.datum = reader.Any("datum");
  backup.alarms = reader.Any("alarms");
  const std::map<std::string, std::string> memory = reader.Texts("memory");
  if (!reader.status()) return Failure(reader.status().error());
  Result<MemoryCells> cells = CellsIn(memory);
  if (!cells) return Failure(cells.error());
  backup.cells = *std::move(cells);
  return backup;
}

Result<BackupContents> ContentsOf(const DeviceBackup& backup, const Family& family) {
  BackupContents contents{.cells = backup.cells, .values = {}};
  for (const auto& [name, text] : backup.parameters) {
    if (FindParameter(family.parameters, name) == nullptr) {
      return Failure(UnknownParameter(family.parameters, Printable(name)));
    }
  }
  for (const ParameterSpec& parameter : family.parameters) {
    const auto found = backup.parameters.find(std::string(parameter.name));
    if (found == backup.parameters.end()) continue;
    const Result<std::uint16_t> raw = ParseParameter(parameter, found->second);
    if (!raw) return Failure(std::string(parameter.name) + ": " + raw.error().text);
    contents.values.push_back({&parameter, *raw});
  }
  return contents;
}

std::string OtherUnit(const DeviceBackup& backup, const device_info_t& info) {
  const std::string serial = Printable(info.serial);
  if (backup.identity >= 0 && info.identity >= 0 && backup.identity != info.identity) {
    return "its identity is " + std::to_string(info.identity) + ", the backup is of identity " +
           std::to_string(backup.identity);
  }
  if (!backup.serial.empty() && !serial.empty() && backup.serial != serial) {
    return "its serial number is " + serial + ", the backup is of " + backup.serial;
  }
  return "";
}

}  // namespace axlecast
