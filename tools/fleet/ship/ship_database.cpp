#include "tools/fleet/ship/ship_database.h"

#include <algorithm>
#include <utility>

#include "core/base/spelling.h"
#include "core/base/utc_text.h"
#include "tools/fleet/schema/migration.h"
#include "tools/fleet/ship/row_tables.h"

namespace axlecast {
namespace {

using db::DatabaseError;
using db::DatabaseFault;
using db::Parameter;

constexpr std::int64_t kDayUs = 86'400'000'000;
// As axlecast.ensure_partitions allows, with a day of room for a server whose clock is set meanwhile.
constexpr std::int64_t kPastDays = 3'649;
constexpr std::int64_t kFutureDays = 7;
constexpr const char* kNoInstallation =
    "00000000-0000-0000-0000-000000000000";  // `fleet adopt`: the next one that comes

ShipFault FaultFor(DatabaseFault fault) {
  switch (fault) {
    case DatabaseFault::kStopped:
      return ShipFault::kStopped;
    case DatabaseFault::kConstraint:
    case DatabaseFault::kBadValue:
      return ShipFault::kRefused;
    default:
      return ShipFault::kAway;
  }
}

tl::unexpected<ShipError> Failed(const DatabaseError& error) {
  return tl::unexpected<ShipError>(ShipError{{error.text, 0}, FaultFor(error.fault)});
}
tl::unexpected<ShipError> Failed(std::string text, ShipFault fault = ShipFault::kAway) {
  return tl::unexpected<ShipError>(ShipError{{std::move(text), 0}, fault});
}

LedgerEntry EntryAt(const db::Rows& rows, int row, int column) {
  LedgerEntry entry;
  entry.id = static_cast<std::int32_t>(rows.Int(row, column).value_or(0));
  entry.upto = rows.Int(row, column + 1).value_or(0);
  entry.bytes = rows.Int(row, column + 2).value_or(0);
  entry.chain = static_cast<std::uint32_t>(rows.Int(row, column + 3).value_or(0));
  entry.closed = rows.Bool(row, column + 4).value_or(false);
  entry.last_utime = rows.Int(row, column + 5).value_or(0);
  return entry;
}

Parameter TimeOrNull(std::int64_t utime) { return utime == 0 ? Parameter::Null() : Parameter::Timestamp(utime); }
Parameter CountOrNull(std::int64_t count) { return count < 0 ? Parameter::Null() : Parameter::Int(count); }
Parameter UtimeOrNull(std::int64_t utime) { return utime == 0 ? Parameter::Null() : Parameter::Int(utime); }

// The time of the first sample of each stream.
std::vector<std::int64_t> FirstSeen(const BatchRows& rows) {
  std::vector<std::int64_t> seen(rows.streams.size(), INT64_MAX);
  for (const auto& row : rows.chunks) seen[row.stream] = std::min(seen[row.stream], row.t0);
  for (const auto& row : rows.seconds) seen[row.stream] = std::min(seen[row.stream], row.t);
  for (const auto& row : rows.minutes) seen[row.stream] = std::min(seen[row.stream], row.t);
  return seen;
}

}  // namespace

ShipDatabase::ShipDatabase(ShipDatabaseSettings settings, SecretSource& secrets, const Clock& clock)
    : settings_(std::move(settings)), secrets_(secrets), clock_(clock) {}
ShipDatabase::~ShipDatabase() = default;

bool ShipDatabase::connected() const { return database_ != nullptr && database_->connected(); }
std::string ShipDatabase::host() const { return database_ == nullptr ? "" : database_->host(); }

void ShipDatabase::Forget() {
  database_.reset();
  ledger_.clear();
  devices_.clear();
  streams_.clear();
  days_.clear();
}

ShipResult<> ShipDatabase::Connect() {
  Forget();
  for (ShipResult<> (ShipDatabase::*const step)() :
       {&ShipDatabase::ConnectToShard, &ShipDatabase::CheckTables, &ShipDatabase::FindMachine, &ShipDatabase::Claim,
        &ShipDatabase::ReadLedger}) {
    if (ShipResult<> done = (this->*step)(); !done) {
      Forget();
      return done;
    }
  }
  return {};
}

ShipResult<> ShipDatabase::ConnectToShard() {
  const auto connect = [this](const std::string& connection) {
    database_ =
        std::make_unique<db::Database>(db::DatabaseSettings{.connection = connection,
                                                            .password = settings_.password,
                                                            .application = "axlecast ship " + settings_.machine,
                                                            .stop = settings_.stop,
                                                            .timelines = &timelines_},
                                       secrets_);
    auto connected = database_->Connect();
    for (std::string& notice : database_->TakeNotices()) warning_ = std::move(notice);
    return connected;
  };
  warning_.clear();
  const auto connect_to_shard = [&]() -> ShipResult<> {
    const auto connected = connect(shard_);
    if (connected) return {};
    return Failed("the shard of the machine " + settings_.machine + ": " + connected.error().text,
                  FaultFor(connected.error().fault));
  };
  if (const auto connected = connect(settings_.connection); !connected) {
    // The coordinator is needed at the start only.
    if (shard_.empty() || !db::MayPassLater(connected.error().fault)) return Failed(connected.error());
    return connect_to_shard();
  }
  const auto has_shards = database_->Query("SELECT to_regclass('axlecast.shard') IS NOT NULL");
  if (!has_shards) return Failed(has_shards.error());
  shard_.clear();
  if (!has_shards->Bool(0, 0).value_or(false)) return {};
  const auto shard = database_->Query("SELECT connection FROM axlecast.shard WHERE machine = $1",
                                      {Parameter::Text(settings_.machine)});
  if (!shard) return Failed(shard.error());
  if (shard->empty()) return {};
  shard_ = std::string(shard->Text(0, 0));
  return connect_to_shard();
}

ShipResult<> ShipDatabase::CheckTables() {
  if (const auto checked = CheckSchema(*database_); !checked) return Failed(checked.error());
  const auto now = database_->Query("SELECT (extract(epoch FROM clock_timestamp()) * 1000000)::int8");
  if (!now) return Failed(now.error());
  server_ahead_us_ = now->Int(0, 0).value_or(0) - clock_.Now() / kMicrosecond;
  return {};
}

ShipResult<> ShipDatabase::FindMachine() {
  const auto rows = database_->Query(
      "SELECT id, installation, shipper, installation = $2::uuid OR installation = $3::uuid FROM axlecast.machine "
      "WHERE name = $1",
      {Parameter::Text(settings_.machine), Parameter::Text(settings_.installation),
       Parameter::Text(kNoInstallation)});
  if (!rows) return Failed(rows.error());
  if (rows->empty()) return AddMachine();
  if (!rows->Bool(0, 3).value_or(false)) {
    const std::string name = Quoted(settings_.machine);
    return Failed("the database has a machine " + name + " of another installation, last shipped by " +
                  (rows->IsNull(0, 2) ? "nobody" : std::string(rows->Text(0, 2))) +
                  ": two machines have one name. Give one of them another name; if this host replaces the other "
                  "one, run `axlecast fleet adopt " +
                  settings_.machine + "`");
  }
  machine_ = static_cast<std::int32_t>(rows->Int(0, 0).value_or(0));
  return {};
}

ShipResult<> ShipDatabase::AddMachine() {
  const auto other = database_->Query("SELECT name FROM axlecast.machine WHERE installation = $1::uuid",
                                      {Parameter::Text(settings_.installation)});
  if (!other) return Failed(other.error());
  if (!other->empty()) {
    const std::string old_name(other->Text(0, 0));
    return Failed("the database knows this installation as the machine " + Quoted(old_name) + ", not " +
                  Quoted(settings_.machine) + ": if the machine was renamed, run `axlecast fleet rename " +
                  old_name + ' ' + settings_.machine +
                  "`; if it is another machine on this host, give it its own --state");
  }
  const auto added = database_->Query(
      "INSERT INTO axlecast.machine (name, installation) VALUES ($1, $2::uuid) ON CONFLICT DO NOTHING RETURNING id",
      {Parameter::Text(settings_.machine), Parameter::Text(settings_.installation)});
  if (!added) return Failed(added.error());
  if (added->empty()) return Failed("another shipper has just added the machine " + Quoted(settings_.machine));
  machine_ = static_cast<std::int32_t>(added->Int(0, 0).value_or(0));
  return {};
}

ShipResult<> ShipDatabase::Claim() {
  // A standby that became the primary may have lost the claim: it is repeated. A greater generation is another shipper's.
  const auto claimed = database_->Query(
      "UPDATE axlecast.machine SET generation = CASE WHEN $4::int8 = 0 THEN generation + 1 ELSE $4::int8 END, "
      "installation = $2::uuid, shipper = $3, shipper_since = CASE WHEN generation = $4::int8 THEN shipper_since "
      "ELSE now() END WHERE id = $1::int4 AND ($4::int8 = 0 OR generation <= $4::int8) RETURNING generation",
      {Parameter::Int(machine_), Parameter::Text(settings_.installation), Parameter::Text(settings_.shipper),
       Parameter::Int(generation_)});
  if (!claimed) return Failed(claimed.error());
  if (!claimed->empty()) {
    generation_ = claimed->Int(0, 0).value_or(0);
    return {};
  }
  const auto other = database_->Query("SELECT coalesce(shipper, '') FROM axlecast.machine WHERE id = $1::int4",
                                      {Parameter::Int(machine_)});
  if (!other) return Failed(other.error());
  return tl::unexpected<ShipError>(Fenced(other->empty() ? "" : std::string(other->Text(0, 0))));
}

ShipError ShipDatabase::Fenced(const std::string& shipper) const {
  return {{"another shipper (" + shipper + ") has taken the machine " + Quoted(settings_.machine) +
               " over: this one ends. Only one may run; stop the other one, and start this one again if it should "
               "be this one",
           0},
          ShipFault::kFenced};
}

ShipResult<> ShipDatabase::ReadLedger() {
  const auto rows = database_->Query(
      "SELECT name, host, start_utime, file_number, id, upto, bytes, chain, closed, last_utime FROM axlecast.log "
      "WHERE machine = $1::int4",
      {Parameter::Int(machine_)});
  if (!rows) return Failed(rows.error());
  for (int row = 0; row < rows->size(); ++row) {
    const LogKey key{std::string(rows->Text(row, 0)), std::string(rows->Text(row, 1)),
                     rows->Int(row, 2).value_or(0), static_cast<std::int32_t>(rows->Int(row, 3).value_or(0))};
    ledger_[key] = EntryAt(*rows, row, 4);
  }
  return {};
}

UtimeRange ShipDatabase::range() const {
  const std::int64_t today = (clock_.Now() / kMicrosecond + server_ahead_us_) / kDayUs;
  return {(today - kPastDays) * kDayUs, (today + kFutureDays) * kDayUs};
}

ShipResult<LedgerEntry> ShipDatabase::EntryOf(const LogKey& key, const std::string& file) {
  if (const auto found = ledger_.find(key); found != ledger_.end()) return found->second;
  const std::vector<Parameter> identity = {Parameter::Int(machine_),        Parameter::Text(key.name),
                                           Parameter::Text(key.host),       Parameter::Int(key.start_utime),
                                           Parameter::Int(key.file_number), Parameter::Text(file)};
  const auto rows = database_->Query(
      "INSERT INTO axlecast.log (machine, name, host, start_utime, file_number, file) VALUES ($1::int4, $2, $3, "
      "$4, $5, $6) ON CONFLICT (machine, name, host, start_utime, file_number) DO UPDATE SET file = excluded.file "
      "RETURNING id, upto, bytes, chain, closed, last_utime",
      identity);
  if (!rows) {
    const auto failed = Failed(rows.error());
    Forget();
    return failed;
  }
  return ledger_[key] = EntryAt(*rows, 0, 0);
}

ShipResult<> ShipDatabase::EnsurePartitions(const BatchRows& rows) {
  for (const std::int64_t day : DaysOf(rows)) {
    if (days_.contains(day)) continue;
    // 0: the epoch's day.
    const auto made = database_->Query(
        "SELECT axlecast.ensure_partitions(date '1970-01-01' + $1::int4, date '1970-01-01' + $1::int4)",
        {Parameter::Int(day)});
    if (!made) return Failed(made.error());
    days_.insert(day);
  }
  return {};
}

ShipResult<std::int32_t> ShipDatabase::DeviceId(const std::string& device) {
  if (const auto found = devices_.find(device); found != devices_.end()) return found->second;
  const auto rows = database_->Query(
      "WITH added AS (INSERT INTO axlecast.device (machine, name) VALUES ($1::int4, $2) ON CONFLICT DO NOTHING "
      "RETURNING id) SELECT id FROM added UNION ALL SELECT id FROM axlecast.device WHERE machine = $1::int4 AND "
      "name = $2",
      {Parameter::Int(machine_), Parameter::Text(device)});
  if (!rows) return Failed(rows.error());
  if (rows->empty()) return Failed("another session has just added the device " + device, ShipFault::kMoved);
  return devices_[device] = static_cast<std::int32_t>(rows->Int(0, 0).value_or(0));
}

ShipResult<std::int32_t> ShipDatabase::StreamIdOf(const StreamKey& stream, std::int64_t seen) {
  if (const auto found = streams_.find(stream); found != streams_.end()) return found->second;
  ShipResult<std::int32_t> device = DeviceId(stream.device);
  if (!device) return device;
  const auto rows = database_->Query(
      "WITH added AS (INSERT INTO axlecast.stream (device, boot_id, datum_epoch, counts_per_turn, unit, "
      "unit_per_count, seen) VALUES ($1::int4, $2, $3, $4, $5, $6::float8, $7) ON CONFLICT DO NOTHING RETURNING "
      "id) SELECT id FROM added UNION ALL SELECT id FROM axlecast.stream WHERE device = $1::int4 AND boot_id = $2 "
      "AND datum_epoch = $3 AND counts_per_turn = $4 AND unit = $5 AND unit_per_count IS NOT DISTINCT FROM "
      "$6::float8",
      {Parameter::Int(*device), Parameter::Int(stream.boot_id), Parameter::Int(stream.datum_epoch),
       Parameter::Int(stream.counts_per_turn), Parameter::Int(stream.unit),
       stream.unit_per_count ? Parameter::Float(*stream.unit_per_count) : Parameter::Null(),
       Parameter::Timestamp(seen)});
  if (!rows) return Failed(rows.error());
  if (rows->empty())
    return Failed("another session has just added a stream of " + stream.device, ShipFault::kMoved);
  return streams_[stream] = static_cast<std::int32_t>(rows->Int(0, 0).value_or(0));
}

ShipResult<> ShipDatabase::MoveLedger(const ShipBatch& batch) {
  const auto moved = database_->Execute(
      "UPDATE axlecast.log AS l SET upto = $3, bytes = $4, chain = $5, closed = $6, file = $7, first_utime = "
      "least(l.first_utime, $8), last_utime = greatest(l.last_utime, $9), samples = l.samples + $10, events = "
      "l.events + $11 FROM axlecast.machine AS m WHERE l.id = $1::int4 AND l.upto = $2 AND m.id = l.machine AND "
      "m.generation = $12",
      {Parameter::Int(batch.before.id), Parameter::Int(batch.before.upto), Parameter::Int(batch.after.upto),
       Parameter::Int(batch.after.bytes), Parameter::Int(batch.after.chain), Parameter::Bool(batch.after.closed),
       Parameter::Text(batch.file), UtimeOrNull(batch.rows.first_utime), UtimeOrNull(batch.rows.last_utime),
       Parameter::Int(batch.rows.samples), Parameter::Int(EventRows(batch.rows)), Parameter::Int(generation_)});
  if (!moved) return Failed(moved.error());
  if (*moved == 1) return {};
  const auto machine =
      database_->Query("SELECT generation, coalesce(shipper, '') FROM axlecast.machine WHERE id = $1::int4",
                       {Parameter::Int(machine_)});
  if (!machine) return Failed(machine.error());
  if (!machine->empty() && machine->Int(0, 0) != generation_) {
    return tl::unexpected<ShipError>(Fenced(std::string(machine->Text(0, 1))));
  }
  return Failed("the ledger of " + batch.file + " was moved by somebody else", ShipFault::kMoved);
}

ShipResult<> ShipDatabase::WriteRows(const ShipBatch& batch) {
  RowIds ids{.machine = machine_, .log = batch.before.id, .streams = {}};
  const std::vector<std::int64_t> seen = FirstSeen(batch.rows);
  for (std::size_t i = 0; i < batch.rows.streams.size(); ++i) {
    const ShipResult<std::int32_t> id = StreamIdOf(batch.rows.streams[i], seen[i]);
    if (!id) return tl::unexpected<ShipError>(id.error());
    ids.streams.push_back(*id);
  }
  for (const TableRows& table : CopyTables(batch.rows, ids)) {
    if (const auto copied = database_->Copy(table.table, table.rows); !copied) return Failed(copied.error());
  }
  for (const RowStatement& statement : InsertStatements(batch.rows, ids)) {
    if (const auto inserted = database_->Execute(statement.sql, statement.parameters); !inserted)
      return Failed(inserted.error());
  }
  for (const HoleRow& hole : batch.holes) {
    if (ShipResult<> inserted = InsertHole(batch.before.id, hole); !inserted) return inserted;
  }
  return {};
}

ShipResult<> ShipDatabase::InsertHole(std::optional<std::int32_t> log, const HoleRow& hole) {
  const auto inserted = database_->Execute(
      "INSERT INTO axlecast.hole (machine, log, cause, t0, t1, first_event, messages, bytes) VALUES ($1::int4, "
      "$2::int4, $3, $4, $5, $6, $7, $8) ON CONFLICT DO NOTHING",
      {Parameter::Int(machine_), log ? Parameter::Int(*log) : Parameter::Null(), Parameter::Text(hole.cause),
       TimeOrNull(hole.t0), TimeOrNull(hole.t1),
       hole.first_event ? Parameter::Int(*hole.first_event) : Parameter::Null(), CountOrNull(hole.messages),
       CountOrNull(hole.bytes)});
  if (!inserted) return Failed(inserted.error());
  return {};
}

ShipResult<> ShipDatabase::Write(const ShipBatch& batch) {
  if (const auto begun = database_->Begin(); !begun) return Failed(begun.error());
  if (ShipResult<> moved = MoveLedger(batch); !moved) return moved;
  if (ShipResult<> written = WriteRows(batch); !written) return written;
  const auto machine = database_->Execute(
      "UPDATE axlecast.machine SET last_batch = now(), last_utime = greatest(last_utime, $2), lag_bytes = $3, "
      "lag_logs = $4 WHERE id = $1::int4",
      {Parameter::Int(machine_), UtimeOrNull(batch.rows.last_utime), Parameter::Int(batch.lag.bytes),
       Parameter::Int(batch.lag.logs)});
  if (!machine) return Failed(machine.error());
  const db::Commit commit = database_->CommitTransaction();
  if (commit.state == db::CommitState::kCommitted) return {};
  if (commit.state == db::CommitState::kUnknown && commit.error.fault != DatabaseFault::kStopped) {
    return Failed("the outcome of a batch is unknown: " + commit.error.text, ShipFault::kAway);
  }
  return Failed(commit.error);
}

ShipResult<> ShipDatabase::Commit(const ShipBatch& batch) {
  ShipResult<> done = EnsurePartitions(batch.rows);
  if (done) done = Write(batch);
  if (done) {
    ledger_[batch.key] = batch.after;
    return {};
  }
  if (done.error().fault == ShipFault::kRefused && connected()) {
    // A partition may have been dropped; ids that were created are gone with the transaction.
    database_->Rollback();
    days_.clear();
    devices_.clear();
    streams_.clear();
    if (connected()) return done;
  }
  Forget();
  return done;
}

ShipResult<> ShipDatabase::AddHole(const std::optional<LogKey>& key, const std::string& file, HoleRow hole) {
  std::optional<std::int32_t> log;
  if (key) {
    const ShipResult<LedgerEntry> entry = EntryOf(*key, file);
    if (!entry) return tl::unexpected<ShipError>(entry.error());
    if (entry->closed) return {};  // it was complete after all
    log = entry->id;
    hole.first_event = std::max(hole.first_event.value_or(0), entry->upto);
    if (hole.t0 == 0) hole.t0 = entry->last_utime != 0 ? entry->last_utime : key->start_utime;
  }
  ShipResult<> inserted = InsertHole(log, hole);
  if (!inserted) Forget();
  return inserted;
}

ShipResult<> ShipDatabase::Expire() {
  days_.clear();  // their partitions may be dropped
  // Less than the hour of ExpirySchedule, so that the shipper that has done it is in time for the next hour.
  const auto expired = database_->Query("SELECT count(*) FROM axlecast.expire(interval '50 minutes')");
  if (expired) return {};
  if (!connected()) Forget();
  return Failed("what is older than its retention was not deleted: " + expired.error().text,
                FaultFor(expired.error().fault));
}

}  // namespace axlecast
