#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/store/database.h"
#include "bridge/store/durable_store.h"
#include "bridge/store/rows.h"

namespace axlecast {

// Which commands or events; what is left out does not matter.
struct HistoryFilter {
  std::string id = {};  // of the command, or how it begins: lower-case hex
  std::string device = {};
  std::string operation = {};
  std::string who = {};
  std::optional<std::int8_t> state = {};         // command_status_t STATE_*
  std::optional<std::int64_t> since_utime = {};  // us, UNIX time; that instant included
  std::optional<std::int64_t> until_utime = {};  // not included
  std::optional<std::int64_t> limit = {};        // the newest of those
};

// A state of a command, and its timestamp.
struct CommandStep {
  std::int64_t utime = 0;  // us, UNIX time
  std::int8_t state = 0;
  bool verified = false;
  std::int8_t finding = 0;
  std::int32_t reason_code = 0;
  std::string text;
  float progress = 0;
  std::vector<change_t> changes;
};

struct DeviceRecord {
  std::string device;
  AxisRecord axis;
};

struct DatumHistory {
  DatumRecord datum;
  bool in_force = false;  // else made void, or another was set after it
};

// A place in the journal: what is written later is after it.
struct JournalMark {
  std::int64_t step = 0;
  std::int64_t event = 0;
};

// Reads the journal's file, while the bridge writes it or not.
class HistoryReader {
 public:
  explicit HistoryReader(const std::string& file);

  // Fails if the file could not be opened, or something could not be read since.
  [[nodiscard]] const Result<>& state() const { return state_; }
  [[nodiscard]] std::string Machine();

  using Mark = JournalMark;
  [[nodiscard]] Mark Now();

  // Return commands and events, oldest first. With `from`, only commands that ended or got their finding between `from` and
  // `to`, and events between both. Of the filter, events use only device, times and limit.
  [[nodiscard]] std::vector<CommandRow> Commands(const HistoryFilter& filter, const std::optional<Mark>& from = {},
                                                 const Mark& to = {});
  [[nodiscard]] std::vector<AxisEvent> Events(const HistoryFilter& filter, const std::optional<Mark>& from = {},
                                              const Mark& to = {});
  [[nodiscard]] std::vector<CommandStep> Steps(std::int64_t command_number);

  [[nodiscard]] std::vector<DeviceRecord> Devices();
  // What was reported of its alarms, and holds.
  [[nodiscard]] std::vector<AlarmMark> AlarmMarks(const std::string& device);
  // Newest first.
  [[nodiscard]] std::vector<DatumHistory> Datums(const std::string& device);

 private:
  [[nodiscard]] std::int64_t Highest(const char* sql);
  void Check();

  std::unique_ptr<Database> database_;
  Result<> state_;
};

}  // namespace axlecast
