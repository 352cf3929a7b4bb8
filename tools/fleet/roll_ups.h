#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "tools/fleet/position_chunk.h"
#include "tools/fleet/rows.h"

namespace axlecast {

// The rows of seconds and minutes of one device. A second ends with the first sample of another second or stream, and with the batch: the
// database adds the part that is in the next batch.
class RollUps {
 public:
  // Adds a sample of the stream, and the row of the second that it ends to `batch`.
  void Add(const StreamKey& key, const PositionSample& sample, BatchRows& batch);
  // Ends the second and all minutes.
  void End(BatchRows& batch);

 private:
  struct Second {
    StreamKey key;
    std::int64_t begin = 0;
    SummaryBuilder summary = {};
    SummaryBuilder* minute = nullptr;  // in minutes_
  };

  void EndSecond(BatchRows& batch);

  std::optional<Second> second_;
  std::map<std::pair<StreamKey, std::int64_t>, SummaryBuilder> minutes_;  // by stream and begin
};

// Joins the rows of one stream and time, and sorts them: a batch may contain several parts of a second or minute.
void JoinRollUps(std::vector<RollUpRow>& rows);

}  // namespace axlecast
