#pragma once

#include <future>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "core/base/result.h"
#include "tools/fleet/ship/log_shipment.h"

namespace axlecast {

// The batches of one log, of which one may be composed in a thread of its own while the database takes the batch before it. After a
// failed batch, make a new pipeline from the ledger. One thread.
class BatchPipeline {
 public:
  explicit BatchPipeline(std::unique_ptr<LogShipment> shipment) : shipment_(std::move(shipment)) {}

  // As LogShipment::Refresh. Does nothing while a batch is prepared: call it again before the batch after that.
  [[nodiscard]] Result<> Refresh(const FolderLog& log) {
    return prepared_.valid() ? Result<>() : shipment_->Refresh(log);
  }
  // Returns the batch that was prepared, whatever its range and limit; else as LogShipment::Next.
  [[nodiscard]] ComposedBatch Next(const UtimeRange& range, const BatchLimit& limit) {
    return prepared_.valid() ? prepared_.get() : shipment_->Next(range, limit);
  }
  // As LogShipment::NextAsHole. No batch may be prepared.
  [[nodiscard]] ComposedBatch NextAsHole(const std::string& cause) { return shipment_->NextAsHole(cause); }
  // Begins to compose the batch that the following call of Next returns. Where no thread can be started, Next composes it.
  void Prepare(const UtimeRange& range, const BatchLimit& limit) {
    try {
      prepared_ = std::async(std::launch::async, [this, range, limit] { return shipment_->Next(range, limit); });
    } catch (const std::system_error&) {
      prepared_ = {};
    }
  }

 private:
  std::unique_ptr<LogShipment> shipment_;
  std::future<ComposedBatch> prepared_;  // its destructor waits for the thread, which uses shipment_
};

}  // namespace axlecast
