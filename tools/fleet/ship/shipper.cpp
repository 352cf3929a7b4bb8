#include "tools/fleet/ship/shipper.h"

#include <poll.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <utility>

#include "platform/os/system_clock.h"
#include "tools/fleet/ship/row_tables.h"
#include "tools/log/log_name.h"

namespace axlecast {
namespace {

constexpr MonoNs kFirstBackoff = kSecond;
constexpr MonoNs kLongestBackoff = 30 * kSecond;
constexpr MonoNs kHolesInterval = 5 * kSecond;
constexpr MonoNs kReadRetry = 30 * kSecond;
constexpr std::size_t kLeastBatch = 64U << 10;  // bytes
constexpr int kRefusedUntilHole = 3;            // 1: partitions are made again; 2: stretch by stretch

bool IsEmpty(const ShipBatch& batch) { return batch.after == batch.before && batch.holes.empty(); }

// Returns true if the recorder of one of the machine's names has written the log.
bool IsOwn(const LogHole& hole, const std::vector<std::string>& names) {
  return std::ranges::any_of(names, [&hole](const std::string& name) {
    return hole.file.starts_with(name + '-') &&
           (hole.name.empty() || LogFileBegin(name + '-' + hole.name, hole.file));
  });
}

}  // namespace

Shipper::Shipper(ShipperSettings settings, ShipDatabase& database, const Clock& clock)
    : settings_(std::move(settings)),
      database_(database),
      clock_(clock),
      folder_(settings_.folder, settings_.names),
      plan_(settings_.newest_first, settings_.bandwidth) {
  status_.away_since = clock_.Now();
}

ShipStatus Shipper::Status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

ShipEnd Shipper::Run() {
  while (!ended_) {
    const MonoNs now = clock_.Now();
    if (now >= next_scan_) Scan();
    if (now >= next_look_) LookAtLiveLogs();
    if (!database_.connected() && now >= next_connect_) Connect();
    if (ended_) break;
    if (database_.connected()) {
      if (now >= next_holes_) RecordHoles();
      if (database_.connected() && expiry_.IsDue(now, database_.seed())) Expire();
    }
    if (database_.connected()) {
      std::vector<WaitingLog> waiting;
      std::vector<Work*> works;
      for (auto& [key, work] : works_) {
        waiting.push_back(WaitingOf(work));
        works.push_back(&work);
      }
      if (const auto next = plan_.Next(waiting, clock_.Now())) {
        ShipOne(*works[*next]);
        SaveMarks(false);
        UpdateStatus();
        if (!ended_) Wait(clock_.Now());
        continue;
      }
      if (settings_.once) ended_ = EndOf();
      SaveMarks(false);
    }
    UpdateStatus();
    if (!ended_) Wait(std::min(next_scan_, next_look_));
  }
  SaveMarks(true);
  UpdateStatus();
  return *ended_;
}

// Returns at `until`; at once if the process should end.
void Shipper::Wait(MonoNs until) {
  std::array<pollfd, 1> stop = {{{settings_.stop, POLLIN, 0}}};
  if (PollUntil(stop, until, clock_) > 0) ended_ = ShipEnd::kStopped;
}

void Shipper::Scan() {
  const MonoNs now = clock_.Now();
  next_scan_ = now + kScanInterval;
  Result<FolderContent> content = folder_.Scan({now, clock_.UtcMicroseconds()});
  {
    const std::lock_guard lock(mutex_);
    status_.problems.folder = content ? "" : content.error().text;
  }
  if (!content) return;
  std::map<LogKey, Work> works;
  for (FolderLog& log : content->logs) {
    const auto found = works_.find(log.key);
    Work work = found == works_.end() ? Work{.log = log} : std::move(found->second);
    // Decompressed or renamed: another file. What is mapped of it stays valid.
    if (work.log.file != log.file) work.pipeline.reset();
    work.log = std::move(log);
    works.emplace(work.log.key, std::move(work));
  }
  works_ = std::move(works);
  skipped_ = std::move(content->skipped);
  for (const auto& [key, work] : works_) {
    if (!work.problem.empty()) skipped_.push_back({work.log.file, work.problem, false});
  }
}

void Shipper::LookAtLiveLogs() {
  next_look_ = clock_.Now() + kLookInterval;
  for (auto& [key, work] : works_) {
    if (work.log.closed) continue;
    struct stat status {};
    if (stat((settings_.folder + '/' + work.log.file).c_str(), &status) == 0) work.log.bytes = status.st_size;
  }
}

void Shipper::Connect() {
  for (auto& [key, work] : works_) work.pipeline.reset();
  const ShipResult<> connected = database_.Connect();
  if (!connected) return OnFailed(connected.error(), nullptr);
  for (auto& [key, work] : works_) work.entry.reset();
  next_holes_ = 0;
  const std::lock_guard lock(mutex_);
  status_.connected = true;
  status_.host = database_.host();
  status_.problems.database = database_.warning();
}

// ---- what is deleted, what is shipped ----

void Shipper::RecordHoles() {
  next_holes_ = clock_.Now() + kHolesInterval;
  const Result<ShippedLogs> shipped = ReadShippedLogs(settings_.folder);
  const Result<std::vector<LogHole>> holes = ReadHoles(settings_.folder, shipped ? *shipped : ShippedLogs());
  if (!holes) return;
  for (const LogHole& hole : *holes) {
    if (!IsOwn(hole, settings_.names) || marks_.logs.contains(hole.file)) continue;
    std::optional<LogKey> key;
    if (hole.logs == 1 && !hole.name.empty()) {
      key = LogKey{hole.name, hole.host, hole.start_utime, static_cast<std::int32_t>(hole.file_number)};
    }
    std::string cause = hole.cause;
    if (!key)
      cause += ": " + hole.file + (hole.logs > 1 ? " and " + std::to_string(hole.logs - 1) + " later logs" : "");
    const HoleRow row{.cause = cause,
                      .t0 = key ? 0 : hole.start_utime,
                      .t1 = hole.last_utime,
                      .first_event = hole.first_event,
                      .messages = -1,
                      .bytes = hole.bytes};
    if (const ShipResult<> added = database_.AddHole(key, hole.file, row); !added)
      return OnFailed(added.error(), nullptr);
    Mark(hole.file, {.upto = hole.first_event}, hole.logs);
    const std::lock_guard lock(mutex_);
    ++status_.holes;
  }
}

// An error of the retention is reported, and does not stop the shipping.
void Shipper::Expire() {
  const ShipResult<> expired = database_.Expire();
  if (!expired && !database_.connected()) return OnFailed(expired.error(), nullptr);
  const std::lock_guard lock(mutex_);
  status_.problems.retention = expired ? "" : expired.error().text;
}

void Shipper::Mark(const std::string& file, const LedgerEntry& entry, std::int64_t hole) {
  marks_.logs[std::string(PlainLogName(file))] = {.upto = entry.upto, .complete = entry.closed, .hole = hole};
  mark_now_ = mark_now_ || entry.closed || hole > 0;
}

void Shipper::SaveMarks(bool now) {
  const MonoNs mono = clock_.Now();
  if (marks_.logs.empty() ||
      !(now || (mark_now_ && mono + kMarkInterval >= next_mark_ + kSecond) || mono >= next_mark_))
    return;
  next_mark_ = mono + kMarkInterval;
  marks_.utime = clock_.UtcMicroseconds();
  const Result<> marked = MarkShipped(settings_.folder, marks_);
  {
    const std::lock_guard lock(mutex_);
    status_.problems.marks = marked ? "" : marked.error().text;
  }
  if (!marked) return;
  marks_.logs.clear();
  mark_now_ = false;
}

// ---- logs ----

bool Shipper::IsComplete(const Work& work) const {
  return work.entry && work.entry->closed && (work.log.compressed || work.log.bytes <= work.entry->bytes);
}

WaitingLog Shipper::WaitingOf(const Work& work) const {
  WaitingLog waiting{.start_utime = work.log.key.start_utime,
                     .live = !work.log.closed,
                     .waiting = 0,
                     .more = work.more,
                     .shipped_at = work.shipped_at};
  if (IsComplete(work) || clock_.Now() < work.retry_at || (settings_.once && work.passed)) return waiting;
  const std::int64_t shipped = work.entry && !work.log.compressed ? work.entry->bytes : 0;
  waiting.waiting = std::max<std::int64_t>(0, work.log.bytes - shipped);
  // A log that has just been closed needs a batch that states it.
  if (work.log.closed || !work.entry) waiting.waiting = std::max<std::int64_t>(1, waiting.waiting);
  return waiting;
}

std::optional<FolderLog> Shipper::PreviousOf(const FolderLog& log) const {
  const FolderLog* previous = nullptr;
  for (const auto& [key, work] : works_) {
    if (key.name != log.key.name || key.host != log.key.host || !(key < log.key)) continue;
    if (previous == nullptr || previous->key < key) previous = &work.log;
  }
  if (previous == nullptr) return std::nullopt;
  return *previous;
}

void Shipper::ReleaseOthers(const Work& current) {
  for (auto& [key, work] : works_) {
    if (work.log.closed && &work != &current) work.pipeline.reset();
  }
}

Result<> Shipper::Open(Work& work) {
  if (work.pipeline != nullptr) return work.pipeline->Refresh(work.log);
  ReleaseOthers(work);
  auto shipment = LogShipment::Open(settings_.folder, work.log, *work.entry, settings_.detail, database_.range(),
                                    PreviousOf(work.log));
  if (!shipment) return Failure(shipment.error());
  work.pipeline = std::make_unique<BatchPipeline>(*std::move(shipment));
  return {};
}

// With a limit of the bandwidth, a batch is about what is allowed in half a second.
BatchLimit Shipper::LimitOf(const Work& work) const {
  BatchLimit limit{.one_stretch = work.refused > 1};
  if (!work.log.closed || settings_.bandwidth == 0) return limit;
  const auto part = static_cast<std::size_t>(settings_.bandwidth / 2);
  limit.bytes = std::clamp(part, std::min(kLeastBatch, limit.bytes), limit.bytes);
  return limit;
}

// While the database takes a batch, the next one is composed. Batches that follow a refused one are not: each may be smaller.
ShipBatch Shipper::NextBatch(Work& work) {
  ComposedBatch next =
      work.refused >= kRefusedUntilHole
          ? work.pipeline->NextAsHole("the database does not accept the rows: see the log of axlecast ship")
          : work.pipeline->Next(database_.range(), LimitOf(work));
  work.more = next.more;
  work.passed = !next.more;
  work.last_received = next.last_received;
  if (next.more && work.refused == 0) work.pipeline->Prepare(database_.range(), LimitOf(work));
  return std::move(next.batch);
}

void Shipper::ShipOne(Work& work) {
  const ShipResult<LedgerEntry> entry = database_.EntryOf(work.log.key, work.log.file);
  if (!entry) return OnFailed(entry.error(), nullptr);
  work.entry = *entry;
  work.shipped_at = clock_.Now();
  if (IsComplete(work)) {
    Mark(work.log.file, *work.entry);
    work.passed = true;
    return;
  }
  if (const Result<> opened = Open(work); !opened) {
    work.pipeline.reset();
    work.problem = opened.error().text;
    work.retry_at = clock_.Now() + kReadRetry;
    work.passed = true;
    return;
  }
  work.problem.clear();
  ShipBatch batch = NextBatch(work);
  if (IsEmpty(batch)) {
    work.caught_up = clock_.UtcMicroseconds();
    return;
  }
  const ShipStatus status = Status();
  batch.lag = {status.lag_bytes, status.lag_logs};
  if (const ShipResult<> done = database_.Commit(batch); !done) return OnFailed(done.error(), &work);
  OnCommitted(work, batch);
}

void Shipper::OnCommitted(Work& work, const ShipBatch& batch) {
  work.entry = batch.after;
  work.refused = 0;
  if (!work.more) work.caught_up = clock_.UtcMicroseconds();
  backoff_ = 0;
  const std::int64_t bytes = std::max<std::int64_t>(0, batch.after.bytes - batch.before.bytes);
  plan_.Shipped(WaitingOf(work), bytes, clock_.Now());
  Mark(work.log.file, *work.entry);
  if (work.entry->closed) work.pipeline.reset();
  const std::lock_guard lock(mutex_);
  ++status_.batches;
  status_.bytes += bytes;
  status_.samples += batch.rows.samples;
  status_.events += EventRows(batch.rows);
  status_.odd += static_cast<std::int64_t>(batch.rows.odd.size());
  status_.holes += static_cast<std::int64_t>(batch.holes.size());
}

void Shipper::OnFailed(const ShipError& error, Work* work) {
  for (auto& [key, other] : works_) other.pipeline.reset();
  if (work != nullptr) {
    work->passed = false;
    if (error.fault == ShipFault::kRefused) ++work->refused;
  }
  const MonoNs now = clock_.Now();
  if (error.fault == ShipFault::kStopped) {
    ended_ = ShipEnd::kStopped;
    return;
  }
  if (error.fault == ShipFault::kFenced) ended_ = ShipEnd::kFenced;
  if (error.fault == ShipFault::kAway && settings_.once) ended_ = ShipEnd::kFailed;
  if (!database_.connected()) {
    const bool at_once = error.fault == ShipFault::kMoved && backoff_ == 0;
    backoff_ = std::clamp(2 * backoff_, kFirstBackoff, kLongestBackoff);
    next_connect_ = at_once ? now : now + backoff_;
  }
  const std::lock_guard lock(mutex_);
  if (!database_.connected() && status_.connected) {
    status_.connected = false;
    status_.away_since = now;
  }
  status_.fenced = error.fault == ShipFault::kFenced;
  status_.problems.database = error.text;
}

std::optional<ShipEnd> Shipper::EndOf() const {
  bool partly = std::ranges::any_of(skipped_, [](const SkippedLog& log) { return !log.foreign; });
  for (const auto& [key, work] : works_) {
    if (!work.passed && !IsComplete(work) && work.log.bytes > 0) return std::nullopt;  // limited by the bandwidth
    partly = partly || !work.problem.empty();
  }
  partly = partly || Status().holes > 0;
  return partly ? ShipEnd::kPartly : ShipEnd::kComplete;
}

void Shipper::UpdateStatus() {
  const std::int64_t utime = clock_.UtcMicroseconds();
  ShipLag lag;
  std::int64_t behind = 0;
  std::int64_t oldest = 0;
  for (const auto& [key, work] : works_) {
    if (IsComplete(work)) continue;
    const std::int64_t shipped = work.entry && !work.log.compressed ? work.entry->bytes : 0;
    const std::int64_t waiting = std::max<std::int64_t>(0, work.log.bytes - shipped);
    if (waiting == 0) continue;
    lag.bytes += waiting;
    ++lag.logs;
    const std::int64_t newest =
        std::max({work.entry ? work.entry->last_utime : 0, work.last_received, key.start_utime});
    const std::int64_t since = std::max(newest, work.caught_up);
    const std::int64_t age = std::max<std::int64_t>(0, utime - since);
    if (!work.log.closed) behind = std::max(behind, age);
    oldest = std::max(oldest, age);
  }
  const std::lock_guard lock(mutex_);
  status_.lag_bytes = lag.bytes;
  status_.lag_logs = lag.logs;
  status_.lag_us = behind;
  status_.oldest_us = oldest;
  status_.skipped = skipped_;
}

}  // namespace axlecast
