#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "platform/db/database.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// Rows of the tables of names.
struct FleetMachine {
  std::int64_t id = 0;
  std::string name;
};
struct FleetDevice {
  std::int64_t id = 0;
  std::string name;
};
struct FleetStream {
  std::int64_t id = 0;
  StreamKey key;
};
// One recorder log, and how much of it is in the database.
struct FleetLog {
  std::int64_t id = 0;
  std::string name;  // of the recorder
  std::string host;
  std::int64_t start_utime = 0;
  std::int64_t file_number = 0;
  std::string file;
  std::int64_t upto = 0;  // events with a number below are in the database
  std::int64_t bytes = 0;
  std::int64_t chain = 0;  // CRC-32C over the data of the seals
  bool closed = false;
  std::int64_t first_utime = 0;  // of its messages; 0: none
  std::int64_t last_utime = 0;
  std::int64_t samples = 0;
  std::int64_t events = 0;
};

// Reads the fleet database: finds the server of a machine, and the ids of its names. An error names what happened and what to change.
// One thread at a time may use an object.
class FleetReader {
 public:
  // `secrets` must outlive the object.
  FleetReader(db::DatabaseSettings settings, SecretSource& secrets);

  // Connects to the database of the settings, and checks that its schema is the one that this version knows.
  [[nodiscard]] Result<> Open();

  // Connects to the server that has the data of the machine: if the table axlecast.shard has a row for the name, another one than
  // Open would connect to. Returns an error for a machine that the server does not know.
  [[nodiscard]] Result<FleetMachine> OpenMachine(const std::string& name);

  // Connects to another server, with the other settings unchanged.
  [[nodiscard]] Result<> OpenOther(const std::string& connection);

  // Returns the connection string of each shard that the table axlecast.shard names, each once, in alphabetical order.
  [[nodiscard]] Result<std::vector<std::string>> Shards();

  // Returns the device `name`, or all devices of the machine, by name, if `name` is empty.
  [[nodiscard]] Result<std::vector<FleetDevice>> Devices(const FleetMachine& machine, const std::string& name);
  // Returns the streams of a device that have rows in a table of positions within the times, in the order of their time. `table`:
  // a name with the schema; `time`: its column of times. `from`, `until`: us, UNIX time.
  [[nodiscard]] Result<std::vector<FleetStream>> Streams(const FleetDevice& device, std::string_view table,
                                                         std::string_view time, std::int64_t from,
                                                         std::int64_t until);
  // Returns the machine's logs, in the order of their start.
  [[nodiscard]] Result<std::vector<FleetLog>> Logs(const FleetMachine& machine);

  // Calls `visit` with each row of a query while it arrives, until it returns false. Then the connection is closed, which is no error.
  [[nodiscard]] Result<> ForEach(const std::string& sql, const db::Parameters& parameters,
                                 const std::function<bool(const db::Rows&)>& visit);

  // Returns true if no server has answered at the last attempt to connect.
  [[nodiscard]] bool no_answer() const { return no_answer_; }

  // The connection, after Open.
  [[nodiscard]] db::Database& database() { return *database_; }

 private:
  [[nodiscard]] Result<> Connect(const db::DatabaseSettings& settings);

  db::DatabaseSettings settings_;
  SecretSource& secrets_;
  std::unique_ptr<db::Database> database_;
  bool no_answer_ = false;
};

}  // namespace axlecast
