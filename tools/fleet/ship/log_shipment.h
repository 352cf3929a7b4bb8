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

// One log on its way into the database: the place behind the last batch, and the composer of its rows. After a failed batch, make a
// new one from the ledger.
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
  // Composes the next batch, which begins at the ledger's position; empty if nothing is sealed yet: its `after` equals `before`. Call
  // Committed before the next one. `lag` of the batch is not set.
  [[nodiscard]] ShipBatch Next(const UtimeRange& range, const BatchLimit& limit);
  // Like Next, but the next stretch becomes a hole with this cause.
  [[nodiscard]] ShipBatch NextAsHole(const std::string& cause);
  // Takes over the position of the batch that was committed.
  void Committed(const ShipBatch& batch);

  // Returns true if Next has reached its limit: more is ready.
  [[nodiscard]] bool more() const { return more_; }
  [[nodiscard]] const LedgerEntry& entry() const { return entry_; }
  [[nodiscard]] std::int64_t bytes() const { return static_cast<std::int64_t>(content_->bytes().size()); }
  // Time of the last message of the batches, as it was received: us, UNIX time; 0: none yet.
  [[nodiscard]] std::int64_t last_received() const { return last_received_; }

 private:
  LogShipment(std::string folder, FolderLog log, const LedgerEntry& entry)
      : folder_(std::move(folder)), log_(std::move(log)), entry_(entry) {}

  void Prime(const std::optional<FolderLog>& previous);
  void PrimeWith(Bytes log, std::int64_t from);
  void Add(const LogStretch& stretch, LedgerEntry& after);
  [[nodiscard]] std::optional<HoleRow> HoleOf(const LogStretch& stretch, const LogPlace& place) const;
  [[nodiscard]] ShipBatch Begin() const;
  void Finish(ShipBatch& batch, const LogPlace& place);

  std::string folder_;
  FolderLog log_;
  LedgerEntry entry_;
  std::unique_ptr<OpenedLog> content_;
  LogPlace place_;
  std::unique_ptr<RowComposer> composer_;
  bool more_ = false;
  std::int64_t last_received_ = 0;
};

}  // namespace axlecast
