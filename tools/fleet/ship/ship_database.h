#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/base/time.h"
#include "platform/db/database.h"
#include "tools/fleet/rows.h"
#include "tools/fleet/ship/log_head.h"

namespace axlecast {

// What the shipper must do after an error of the database.
enum class ShipFault : std::uint8_t {
  kAway,     // try again later with a new connection: no server, a full disk, a wrong password, another schema, …
  kMoved,    // somebody else wrote the ledger, or the outcome of a commit is unknown: read the ledger again
  kFenced,   // a newer shipper has taken the machine over: end
  kRefused,  // the database does not accept these rows, and will not later
  kStopped,  // the process was asked to stop
};
struct ShipError : Error {
  ShipFault fault = ShipFault::kAway;
};
template <typename T = void>
using ShipResult = tl::expected<T, ShipError>;

// A log as the ledger has it.
struct LedgerEntry {
  std::int32_t id = 0;
  std::int64_t upto = 0;    // events below this number are in the database
  std::int64_t bytes = 0;   // of the log up to there
  std::uint32_t chain = 0;  // CRC-32C over the seals up to there
  bool closed = false;      // the log is complete in the database
  std::int64_t last_utime = 0;
  friend bool operator==(const LedgerEntry&, const LedgerEntry&) = default;
};

// Messages that will never be in the database.
struct HoleRow {
  std::string cause = {};
  std::int64_t t0 = 0;  // us, UNIX time; 0: unknown, as t1
  std::int64_t t1 = 0;
  std::optional<std::int64_t> first_event = {};
  std::int64_t messages = -1;  // -1: unknown
  std::int64_t bytes = -1;
};

// What waits on the machine, for the fleet's status.
struct ShipLag {
  std::int64_t bytes = 0;
  std::int64_t logs = 0;
};

// The rows of one log between two positions of the ledger. They are committed together, or not at all.
struct ShipBatch {
  LogKey key;
  std::string file;
  LedgerEntry before;
  LedgerEntry after;  // id as before
  BatchRows rows;
  std::vector<HoleRow> holes;
  ShipLag lag;
};

struct ShipDatabaseSettings {
  std::string connection;  // of the machine's file; the table axlecast.shard there may name another
  SecretPlace password;
  std::string machine;
  std::string installation;  // UUID
  std::string shipper;       // host and process, for people
  int stop = -1;             // as DatabaseSettings::stop
};

// The fleet database as one machine's shipper uses it. The ledger in the database is the only truth: what is read of it is forgotten
// with the connection, and after every failure. One thread.
class ShipDatabase {
 public:
  // `secrets` and `clock` must outlive the object.
  ShipDatabase(ShipDatabaseSettings settings, SecretSource& secrets, const Clock& clock);
  ~ShipDatabase();

  // Connects, checks schema and machine, takes the machine over (once per object) and reads the ledger.
  [[nodiscard]] ShipResult<> Connect();
  [[nodiscard]] bool connected() const;
  [[nodiscard]] std::string host() const;
  // Returns what an administrator should correct although the connection works, for example an old primary that runs; empty: nothing.
  [[nodiscard]] const std::string& warning() const { return warning_; }

  // The times that the database accepts now.
  [[nodiscard]] UtimeRange range() const;
  // Returns the log's entry, which is created if it is missing.
  [[nodiscard]] ShipResult<LedgerEntry> EntryOf(const LogKey& key, const std::string& file);
  // Writes the batch. After an error, the connection is closed unless the rows were refused.
  [[nodiscard]] ShipResult<> Commit(const ShipBatch& batch);
  // Records a log that was deleted before it was complete, once: rows that are equal in log, cause and first event are ignored.
  // `key`: nothing if the head of the log could not be read.
  [[nodiscard]] ShipResult<> AddHole(const std::optional<LogKey>& key, const std::string& file, HoleRow hole);
  // Deletes what is older than its retention, unless a shipper has done so within the last hour. In a transaction of its own.
  [[nodiscard]] ShipResult<> Expire();
  // Differs between shippers, and between runs of one; 0 before the first connection.
  [[nodiscard]] std::uint64_t seed() const {
    return static_cast<std::uint64_t>(machine_) * 1'000'003 + static_cast<std::uint64_t>(generation_);
  }

 private:
  struct StreamId;

  [[nodiscard]] ShipResult<> ConnectToShard();
  [[nodiscard]] ShipResult<> CheckTables();
  [[nodiscard]] ShipResult<> FindMachine();
  [[nodiscard]] ShipResult<> AddMachine();
  [[nodiscard]] ShipResult<> Claim();
  [[nodiscard]] ShipResult<> ReadLedger();
  [[nodiscard]] ShipResult<> EnsurePartitions(const BatchRows& rows);
  [[nodiscard]] ShipResult<std::int32_t> DeviceId(const std::string& device);
  [[nodiscard]] ShipResult<std::int32_t> StreamIdOf(const StreamKey& stream, std::int64_t seen);
  [[nodiscard]] ShipResult<> MoveLedger(const ShipBatch& batch);
  [[nodiscard]] ShipResult<> WriteRows(const ShipBatch& batch);
  [[nodiscard]] ShipResult<> InsertHole(std::optional<std::int32_t> log, const HoleRow& hole);
  [[nodiscard]] ShipResult<> Write(const ShipBatch& batch);
  [[nodiscard]] ShipError Fenced(const std::string& shipper) const;
  void Forget();

  ShipDatabaseSettings settings_;
  SecretSource& secrets_;
  const Clock& clock_;
  std::unique_ptr<db::Database> database_;
  db::Timelines timelines_;  // of the servers of all connections
  std::string shard_;    // connection string of the machine's shard, as the coordinator had it last; empty: none
  std::string warning_;  // of the last Connect
  std::int32_t machine_ = 0;
  std::int64_t generation_ = 0;       // 0: not claimed yet
  std::int64_t server_ahead_us_ = 0;  // the server's clock minus CLOCK_MONOTONIC
  std::map<LogKey, LedgerEntry> ledger_;
  std::map<std::string, std::int32_t> devices_;
  std::map<StreamKey, std::int32_t> streams_;
  std::set<std::int64_t> days_;  // that have partitions
};

}  // namespace axlecast
