#include "tools/axlecast/device_data/replace_backup.h"

#include <algorithm>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/utc_text.h"
#include "tools/axlecast/device_data/parameter_file.h"
#include "tools/axlecast/device_data/parameter_transfer.h"

namespace axlecast {
namespace {

constexpr std::string_view kReadMemory = "eeprom_backup";
constexpr std::string_view kReadParameters = "read_parameters";

}  // namespace

const OperationSpec* BackupOperation(const Family& family) {
  const auto found =
      std::find_if(family.operations.begin(), family.operations.end(), [](const OperationSpec& operation) {
        return operation.reads_only && (operation.name == kReadMemory || operation.name == kReadParameters);
      });
  return found == family.operations.end() ? nullptr : &*found;
}

BackupReading ReadBackup(OperatorClient& client, const Family& family, const CommandOptions& wish) {
  BackupReading reading;
  if (BackupOperation(family)->name == kReadParameters) {
    ParameterReading read = ReadParameters(client, family, wish);
    reading.result = std::move(read.result);
    reading.problem = std::move(read.problem);
    reading.contents.values = std::move(read.values);
    reading.text = ParameterFileText(family, wish.device, reading.contents.values);
    return reading;
  }
  reading.result = client.Execute({.device = wish.device,
                                   .operation = std::string(kReadMemory),
                                   .valid_ms = wish.valid_ms,
                                   .reason = wish.reason});
  if (ExitCode(reading.result) != kExitDone) return reading;
  reading.contents.cells = CellsOf(reading.result.status.changes, reading.problem);
  reading.text = MemoryFileText(reading.result);
  return reading;
}

BackupContents ParseBackup(const Family& family, const std::string& device, const std::string& file,
                           const std::string& text, std::string& problem, std::string& note) {
  BackupContents contents;
  const OperationSpec* operation = BackupOperation(family);
  if (operation == nullptr) {
    problem = "devices of " + std::string(family.name) + " keep nothing that could be backed up";
  } else if (operation->name == kReadParameters) {
    ConfigErrors errors(file);
    contents.values = ParseParameterFile(family, text, errors);
    if (!errors.empty()) problem = errors.Text();
  } else {
    MemoryFile memory = ParseMemoryFile(text);
    if (!memory.problem.empty()) problem = file + ": " + memory.problem;
    if (!memory.device.empty() && memory.device != device) note = file + " is a backup of " + memory.device;
    contents.cells = std::move(memory.cells);
  }
  return contents;
}

std::string BackupFileName(const std::string& device, std::int64_t utime, const std::string& ending) {
  std::string time;
  for (const char c : UtcText(utime)) {
    if (c == ' ') time += 'T';
    if (c >= '0' && c <= '9') time += c;
  }
  return device + '-' + time + 'Z' + ending;
}

}  // namespace axlecast
