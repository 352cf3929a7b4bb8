#include "tools/axlecast/device_data/memory_transfer.h"

#include "core/device/operation.h"

namespace axlecast {
namespace {

CommandRequest WriteRequest(const CommandOptions& wish, const CellRun& run) {
  return {.device = wish.device,
          .operation = "eeprom_write",
          .arguments = {{"address", std::to_string(run.address)}, {"data", HexText(run.after)}},
          .valid_ms = wish.valid_ms,
          .reason = wish.reason};
}

}  // namespace

PermittedCells AskPermitted(OperatorClient& client, const CommandOptions& wish, const MemoryCells& present,
                            const MemoryCells& wanted) {
  PermittedCells permitted;
  for (const CellRun& cell : CellRuns(present, wanted, 1)) {
    CommandRequest request = WriteRequest(wish, cell);
    request.prepare = true;
    CommandResult result = client.Execute(request);
    if (result.outcome() == CommandOutcome::kPrepared) {
      permitted.cells[cell.address] = cell.after.front();
    } else if (result.answered && result.status.reason_code == command_status_t::REASON_NOT_PERMITTED) {
      permitted.not_permitted.push_back(cell.address);
    } else {
      permitted.failed = std::move(result);
      break;
    }
  }
  return permitted;
}

CommandResult WriteCells(OperatorClient& client, const CommandOptions& wish, const CellRun& run) {
  return client.Execute(WriteRequest(wish, run));
}

}  // namespace axlecast
