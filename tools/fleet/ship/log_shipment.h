#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "tools/fleet/detail.h"
#include "tools/fleet/row_composer.h"
#include "tools/fleet/ship/log_folder.h"
#include "tools/fleet/ship/ship_database.h"
#include "tools/log/opened_log.h"
#include "tools/log/sealed_stretches.h"

namespace axlecast {

// The limits of one batch.
struct BatchLimit {
  std::size_t bytes = 8U << 20;  // of the log; the stretch that exceeds it is the last one
  bool one_stretch = false;
};

struct ComposedBatch {
  ShipBatch batch;                 // without `lag`
  bool more = false;               // the batch has reached its limit: more is ready
  std::int64_t last_received = 0;  // of the last message up to its end: us, UNIX time of the reception; 0: none yet
};

// One log on its way into the database: the place behind the last batch, and the composer of its rows. Each batch follows the one
// before it: after a batch that was not committed, make a new object from the ledger. One thread at a time.
class LogShipment {
 public:
  // Opens the log at the place of the ledger, and primes the composer with the messages before. `previous`: the log before this one,
  // or nothing. Fails if the log cannot be read.
  [[nodiscard]] static Result<std::unique_ptr<LogShipment>> Open(const std::string& folder, const FolderLog& log,
                                                                 const LedgerEntry& entry,
                                                                 const DetailRules& detail, const UtimeRange& range,
                                                                 const std::optional<FolderLog>& previous);

  // Reads what a recorder has added meanwhile.
  [[nodiscard]] Result<> Refresh(const FolderLog& log);
  // Composes the batch behind the last one; empty if nothing is sealed yet: its `after` equals `before`.
  [[nodiscard]] ComposedBatch Next(const UtimeRange& range, const BatchLimit& limit);
  // Like Next, but the next stretch becomes a hole with this cause.
  [[nodiscard]] ComposedBatch NextAsHole(const std::string& cause);

 private:
  LogShipment(std::string folder, FolderLog log, const LedgerEntry& entry)
      : folder_(std::move(folder)), log_(std::move(log)), entry_(entry) {}

  void Prime(const std::optional<FolderLog>& previous);
  void PrimeWith(Bytes log, std::int64_t from);
  void Add(const LogStretch& stretch, LedgerEntry& after);
  [[nodiscard]] std::optional<HoleRow> HoleOf(const LogStretch& stretch, const LogPlace& place) const;
  [[nodiscard]] ShipBatch Begin() const;
  [[nodiscard]] ComposedBatch Finish(ShipBatch batch, const LogPlace& place, bool more);

  std::string folder_;
  FolderLog log_;
  LedgerEntry entry_;  // behind the last batch
  std::unique_ptr<OpenedLog> content_;
  LogPlace place_;  // likewise
  std::unique_ptr<RowComposer> composer_;
  std::int64_t last_received_ = 0;
};

}  // namespace axlecast
