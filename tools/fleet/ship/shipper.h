#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/fleet/detail.h"
#include "tools/fleet/ship/batch_pipeline.h"
#include "tools/fleet/ship/expiry_schedule.h"
#include "tools/fleet/ship/log_folder.h"
#include "tools/fleet/ship/ship_database.h"
#include "tools/fleet/ship/ship_plan.h"
#include "tools/fleet/ship/ship_status.h"
#include "tools/log/log_holes.h"
#include "tools/log/shipped_logs.h"

namespace axlecast {

struct ShipperSettings {
  std::string folder;              // of the recorder's logs
  std::vector<std::string> names;  // of the machine, now and before
  DetailRules detail;
  bool newest_first = true;
  std::int64_t bandwidth = 0;
  bool once = false;  // end when everything that is sealed has been shipped
  int stop = -1;      // readable when the process should end
};

// How a run has ended.
enum class ShipEnd : std::uint8_t {
  kStopped,
  kComplete,  // `once`: everything is in the database
  kPartly,    // `once`: something could not be shipped
  kFailed,    // `once`: the database accepts nothing
  kFenced,    // another shipper has taken the machine over
};

// Ships a folder of logs. Run blocks in one thread; Status may be called from any thread. Errors of the database are repeated after
// 1, 2, 4, … 30 s, without end unless `once` is set.
class Shipper {
 public:
  static constexpr MonoNs kScanInterval = kSecond;
  static constexpr MonoNs kLookInterval = 200 * kMillisecond;  // at the logs that are being written
  static constexpr MonoNs kMarkInterval = 10 * kSecond;        // of shipped.json, unless a log is complete

  // `database` and `clock` must outlive the object.
  Shipper(ShipperSettings settings, ShipDatabase& database, const Clock& clock);

  [[nodiscard]] ShipEnd Run();
  [[nodiscard]] ShipStatus Status() const;

 private:
  struct Work {
    FolderLog log;
    std::optional<LedgerEntry> entry = {};  // what the ledger had last
    std::unique_ptr<BatchPipeline> pipeline = {};
    std::int64_t last_received = 0;  // of the last batch, as ComposedBatch
    MonoNs shipped_at = 0;
    bool more = false;           // a batch was full
    int refused = 0;             // batches in a row that the database refused
    MonoNs retry_at = 0;         // the log cannot be read until then
    std::string problem = {};    // why
    std::int64_t caught_up = 0;  // us, UNIX time at which all that was sealed was in the database; 0: never
    bool passed = false;         // `once`: nothing more is sealed
  };

  void Scan();
  void LookAtLiveLogs();
  void Connect();
  void RecordHoles();
  void Expire();
  void Mark(const std::string& file, const LedgerEntry& entry, std::int64_t hole = 0);
  void SaveMarks(bool now);
  [[nodiscard]] bool IsComplete(const Work& work) const;
  [[nodiscard]] WaitingLog WaitingOf(const Work& work) const;
  [[nodiscard]] BatchLimit LimitOf(const Work& work) const;
  void ShipOne(Work& work);
  [[nodiscard]] Result<> Open(Work& work);
  [[nodiscard]] ShipBatch NextBatch(Work& work);
  void OnCommitted(Work& work, const ShipBatch& batch);
  void OnFailed(const ShipError& error, Work* work);
  [[nodiscard]] std::optional<FolderLog> PreviousOf(const FolderLog& log) const;
  [[nodiscard]] std::optional<ShipEnd> EndOf() const;
  void ReleaseOthers(const Work& current);
  void UpdateStatus();
  void Wait(MonoNs until);

  ShipperSettings settings_;
  ShipDatabase& database_;
  const Clock& clock_;
  LogFolder folder_;
  ShipPlan plan_;
  std::map<LogKey, Work> works_;
  std::vector<SkippedLog> skipped_;
  ShippedLogs marks_;  // not yet in shipped.json
  bool mark_now_ = false;
  MonoNs next_scan_ = 0;
  MonoNs next_look_ = 0;
  MonoNs next_holes_ = 0;
  MonoNs next_mark_ = 0;
  MonoNs next_connect_ = 0;
  ExpirySchedule expiry_;
  MonoNs backoff_ = 0;
  std::optional<ShipEnd> ended_;
  mutable std::mutex mutex_;
  ShipStatus status_;  // behind mutex_
};

}  // namespace axlecast
