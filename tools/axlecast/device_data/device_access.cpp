#include "tools/axlecast/device_data/device_access.h"

#include <sodium.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <limits>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/base/utc_text.h"
#include "core/device/operation.h"
#include "core/device/parameter.h"
#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

CommandRequest WriteRequest(const CommandOptions& options, const CellRun& run) {
  return {.device = options.device,
          .operation = "eeprom_write",
          .arguments = {{"address", std::to_string(run.address)}, {"data", HexText(run.after)}},
          .valid_ms = options.valid_ms,
          .reason = options.reason};
}

CommandRequest Request(const CommandOptions& options, const char* operation) {
  return {.device = options.device,
          .operation = operation,
          .valid_ms = options.valid_ms,
          .expect_epoch = options.epoch,
          .reason = options.reason};
}

constexpr const char* kReason = "acceptance";

bool IsPlainRead(const OperationSpec& operation) {
  return operation.reads_only && !operation.internal && !operation.executed_by_bridge &&
         std::none_of(operation.arguments.begin(), operation.arguments.end(),
                      [](const ArgumentSpec& argument) { return argument.required; });
}

void AddValues(const BusConfig& bus, const DeviceRead& read, FindingGroup& group) {
  const std::vector<change_t>& changes = read.result.status.changes;
  const auto values = FromRegisters(bus.family->parameters, changes);
  if (values && !values->empty()) {
    for (const ParameterValue& value : *values) {
      group.Add(std::string(value.parameter->name), ValueText(value));
    }
    return;
  }
  for (const change_t& change : changes) {
    group.Add(read.operation + ": " + change.key, change.after);
  }
  if (changes.empty()) group.Add(read.operation, read.result.status.text, Verdict::kGood);
}

}  // namespace

PermittedCells QueryPermitted(OperatorClient& client, const CommandOptions& options, const MemoryCells& present,
                              const MemoryCells& wanted) {
  PermittedCells permitted;
  for (const CellRun& cell : CellRuns(present, wanted, 1)) {
    CommandRequest request = WriteRequest(options, cell);
    request.prepare = true;
    CommandResult result = client.Execute(request);
    if (result.outcome() == CommandOutcome::kPrepared) {
      permitted.cells[cell.address] = cell.after.front();
    } else if (result.answered && result.status.reason_code == command_status_t::REASON_NOT_PERMITTED) {
      permitted.not_permitted.push_back(cell.address);
    } else {
      permitted.failed = std::move(result);
      break;
    }
  }
  return permitted;
}

CommandResult WriteCells(OperatorClient& client, const CommandOptions& options, const CellRun& run) {
  return client.Execute(WriteRequest(options, run));
}

ParameterReading ReadParameters(OperatorClient& client, const Family& family, const CommandOptions& options) {
  ParameterReading reading;
  reading.result = client.Execute(Request(options, "read_parameters"));
  if (ExitCode(reading.result) == kExitDone) {
    reading.values = FromRegisters(family.parameters, reading.result.status.changes);
  }
  return reading;
}

std::vector<CommandResult> WriteParameters(OperatorClient& client, const CommandOptions& options,
                                           const ParameterChanges& changes) {
  std::vector<CommandResult> results;
  for (const CommandRequest& request : WriteRequests(options, changes)) {
    results.push_back(client.Execute(request));
    if (ExitCode(results.back()) != kExitDone) break;
  }
  return results;
}

std::vector<CommandRequest> WriteRequests(const CommandOptions& options, const ParameterChanges& changes) {
  std::vector<CommandRequest> requests;
  for (std::size_t begin = 0; begin < changes.size(); begin += kMaxArguments) {
    CommandRequest& request = requests.emplace_back(Request(options, "write_parameters"));
    for (std::size_t i = begin; i < std::min(begin + kMaxArguments, changes.size()); ++i) {
      request.arguments.emplace_back(changes[i].parameter->name,
                                     ParameterText(*changes[i].parameter, changes[i].after));
    }
  }
  return requests;
}

bool IsDone(const CommandResult& result) {
  return ExitCode(result) == kExitDone || ExitCode(result) == kExitUnverifiable;
}

int PrintOutcome(const CommandResult& result) {
  std::cerr << ToText(result);
  return ExitCode(result);
}

std::vector<DeviceRead> ReadEverything(OperatorClient& client, const BusConfig& bus, const std::string& device) {
  std::vector<DeviceRead> reads;
  for (const OperationSpec* operation : OperationsOf(bus)) {
    if (!IsPlainRead(*operation)) continue;
    reads.push_back(
        {std::string(operation->name),
         client.Execute({.device = device, .operation = std::string(operation->name), .reason = kReason})});
    if (!reads.back().result.answered) break;  // no bridge: it will not answer the next one either
    // It needs one of several arguments.
    if (reads.back().result.status.reason_code == command_status_t::REASON_BAD_ARGUMENT) reads.pop_back();
  }
  return reads;
}

FindingGroup ReadFindings(const BusConfig& bus, const std::vector<DeviceRead>& reads) {
  FindingGroup group{"Read from the device", {}};
  for (const DeviceRead& read : reads) {
    if (IsDone(read.result)) {
      AddValues(bus, read, group);
    } else {
      group.Add(read.operation, read.result.answered ? read.result.status.text : read.result.problem,
                Verdict::kAttention, "axlecast do DEVICE " + read.operation + " shows more");
    }
  }
  if (reads.empty()) group.Add("reads", "this family has none");
  return group;
}

// ---- backup ----

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

Result<> ReadText(const Json& json, const std::string& key, std::string& text) {
  const auto found = json.find(key);
  if (found == json.end() || !found->is_string()) return Failure(key + " is missing or not a text");
  text = found->get<std::string>();
  return {};
}

// Null leaves `number` unchanged.
Result<> ReadInteger(const Json& json, const std::string& key, std::int64_t& number) {
  constexpr auto kMax = std::uint64_t{std::numeric_limits<std::int64_t>::max()};
  const auto found = json.find(key);
  if (found != json.end() && found->is_null()) return {};
  if (found == json.end() || !found->is_number_integer() ||
      (found->is_number_unsigned() && found->get<std::uint64_t>() > kMax)) {
    return Failure(key + " is missing or not a whole number");
  }
  number = found->get<std::int64_t>();
  return {};
}

Result<> ReadTexts(const Json& json, const std::string& key, std::map<std::string, std::string>& texts) {
  const auto found = json.find(key);
  const auto is_text = [](const Json& value) { return value.is_string(); };
  if (found == json.end() || !found->is_object() || !std::all_of(found->begin(), found->end(), is_text)) {
    return Failure(key + " is missing or not an object of texts");
  }
  texts = found->get<std::map<std::string, std::string>>();
  return {};
}

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

int CheckReading(const BackupReading& reading, const std::string& prefix) {
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
               {"parameters", Json(backup.parameters)},
               {"datum", backup.datum},
               {"alarms", backup.alarms}};
  json[kSumKey] = Sha256(Compact(json));
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

Result<DeviceBackup> ParseDeviceBackup(std::string_view text) {
  if (text.size() > kMaxBackupBytes) {
    return Failure("it is longer than " + std::to_string(kMaxBackupBytes) + " bytes: no backup of a device is");
  }
  const Json json = ParseOutsideJson(text);
  if (const auto form = CheckForm(json); !form) return Failure(form.error());
  DeviceBackup backup;
  std::map<std::string, std::string> memory;
  Result<> read = ReadTexts(json, "parameters", backup.parameters);
  if (read) read = ReadTexts(json, "memory", memory);
  if (read) read = ReadInteger(json, "identity", backup.identity);
  if (read) read = ReadInteger(json, "utime", backup.unix_us);
  const std::pair<const char*, std::string*> texts[] = {
      {"machine", &backup.machine},   {"device", &backup.device},        {"bus", &backup.bus},
      {"family", &backup.family},     {"model", &backup.model},          {"serial", &backup.serial},
      {"firmware", &backup.firmware}, {"written_by", &backup.written_by}};
  for (const auto& [key, member] : texts) {
    if (read) read = ReadText(json, key, *member);
  }
  if (!read) return Failure(read.error());
  backup.datum = json.value("datum", Json());
  backup.alarms = json.value("alarms", Json());
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
