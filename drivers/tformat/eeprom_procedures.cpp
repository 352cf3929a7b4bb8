#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {
namespace {

using Reason = command_status_t;
using EepromCells = std::array<std::uint8_t, kEepromCells>;

// A write takes 18 ms at most: how often and how many times to ask a busy encoder.
constexpr MonoNs kBusyPause = 2 * kMillisecond;
constexpr int kBusyTimes = 25;

// Reads a row of user EEPROM cells with ID D, one by one. While the encoder writes, it answers "busy" without
// data (TS5669 spec Table 4), and the cell is read again later.
class CellReader {
 public:
  enum class Progress : std::uint8_t { kGoing, kDone, kFailed };

  CellReader(std::size_t first, std::size_t count, MonoNs timeout)
      : next_(first), end_(first + count), timeout_(timeout) {}

  [[nodiscard]] Step Next(MonoNs now) const {
    if (now < due_) return WaitUntil(due_);
    return CommandStep(AskCell(static_cast<std::uint8_t>(next_), timeout_));
  }
  [[nodiscard]] Progress OnAnswer(const Answer& answer, MonoNs end, EepromCells& cells) {
    if (!answer.ok()) {
      cause_ = ErrorName(*answer.error);
      return ++failures_ < kTries ? Progress::kGoing : Progress::kFailed;
    }
    failures_ = 0;
    if (!answer.reply.data) {
      cause_ = "busy";
      due_ = end + kBusyPause;
      return ++busy_ < kBusyTimes ? Progress::kGoing : Progress::kFailed;
    }
    busy_ = 0;
    cells[next_++] = *answer.reply.data;
    return next_ < end_ ? Progress::kGoing : Progress::kDone;
  }
  [[nodiscard]] std::size_t next() const { return next_; }
  // after kFailed
  [[nodiscard]] std::string Failure() const {
    return Text("EEPROM address %zu could not be read (%s)", next_, cause_);
  }

 private:
  std::size_t next_;
  std::size_t end_;
  MonoNs timeout_;
  MonoNs due_ = 0;
  int busy_ = 0;
  int failures_ = 0;
  const char* cause_ = "";
};

// Changes that show cells [first, first + count), 20 to a change: key eeprom_<first address>, "A1 05 ..." as value.
// `before` may be null.
std::vector<Change> CellChanges(std::size_t first, std::size_t count, const EepromCells* before,
                                const EepromCells& after) {
  constexpr std::size_t kCellsPerChange = 20;
  std::vector<Change> changes;
  for (std::size_t at = first; at < first + count; at += kCellsPerChange) {
    const std::size_t length = std::min(kCellsPerChange, first + count - at);
    changes.push_back({"eeprom_" + std::to_string(at),
                       before == nullptr ? "" : HexText(Bytes(*before).subspan(at, length)),
                       HexText(Bytes(after).subspan(at, length))});
  }
  return changes;
}

// Reads a row of user EEPROM cells and shows them.
class EepromRead final : public Procedure {
 public:
  // With `expected`, the change `finding` reports whether the cells hold these bytes (one for each cell).
  EepromRead(std::size_t first, std::size_t count, std::optional<std::vector<std::uint8_t>> expected,
             MonoNs timeout)
      : first_(first), count_(count), expected_(std::move(expected)), reader_(first, count, timeout) {}

  [[nodiscard]] Step Next(MonoNs now) const override { return reader_.Next(now); }
  std::optional<Outcome> OnStarted(Bytes, MonoNs) override { return std::nullopt; }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
    switch (reader_.OnAnswer(answer, end, cells_)) {
      case CellReader::Progress::kGoing:
        return std::nullopt;
      case CellReader::Progress::kFailed:
        return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY, reader_.Failure());
      default:
        return Done();
    }
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                 Text("the link was lost before EEPROM address %zu was read", reader_.next()));
  }

 private:
  [[nodiscard]] Outcome Done() const {
    Outcome outcome = Verified(Text("EEPROM %zu to %zu read", first_, first_ + count_ - 1));
    outcome.changes = CellChanges(first_, count_, nullptr, cells_);
    if (expected_) {
      const bool equal =
          std::equal(expected_->begin(), expected_->end(), cells_.begin() + static_cast<int>(first_));
      constexpr std::size_t kRoomForCells = 3;  // an outcome holds four changes
      if (outcome.changes.size() > kRoomForCells) outcome.changes.resize(kRoomForCells);
      outcome.changes.push_back(FindingChange(FindingWord(equal)));
    }
    return outcome;
  }

  std::size_t first_;
  std::size_t count_;
  std::optional<std::vector<std::uint8_t>> expected_;
  CellReader reader_;
  EepromCells cells_{};
};

// Writes user EEPROM cells. All 80 cells are read first: servo motors may keep their name plate there. A cell that
// holds its value already is not written. Each other cell is written once (ID 6) and, after the 18 ms that this
// takes (TS5669 spec 8.1), read back with ID D. A busy or misunderstood request was not taken and is sent again;
// one whose reply is lost is judged by the read-back. A reply to ID 6 proves that the write was accepted, not that it is
// done: what could not be read back is INDETERMINATE, and the outcome names the cells that were begun.
class EepromWrite final : public Procedure {
 public:
  EepromWrite(std::size_t address, std::vector<std::uint8_t> data, MonoNs timeout)
      : address_(address), data_(std::move(data)), timeout_(timeout), reader_(0, kEepromCells, timeout) {}

  [[nodiscard]] Step Next(MonoNs now) const override {
    if (now < due_) return WaitUntil(due_);
    if (stage_ != Stage::kWrite) return reader_.Next(now);
    return CommandStep(WriteCell(static_cast<std::uint8_t>(cell()), data_[done_], timeout_));
  }
  std::optional<Outcome> OnStarted(Bytes, MonoNs) override {
    if (stage_ == Stage::kWrite) begun_ = in_doubt_ = true;
    return std::nullopt;
  }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
    switch (stage_) {
      case Stage::kBackup:
        return OnBackup(answer, end);
      case Stage::kWrite:
        return OnWritten(answer, end);
      default:
        return OnReadBack(answer, end);
    }
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    if (in_doubt_) {
      return WithChanges(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                               Text("the link was lost before EEPROM %zu could be read back: ", cell()) + Cells()));
    }
    const Outcome outcome = Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the link was lost: " + Cells());
    return stage_ == Stage::kBackup ? outcome : WithChanges(outcome);
  }
  [[nodiscard]] bool touched() const override { return writes_ > 0 || in_doubt_; }

 private:
  enum class Stage : std::uint8_t { kBackup, kWrite, kReadBack };

  std::optional<Outcome> OnBackup(const Answer& answer, MonoNs end) {
    const CellReader::Progress progress = reader_.OnAnswer(answer, end, backup_);
    if (progress == CellReader::Progress::kFailed) {
      return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                   "nothing was written: no backup first, " + reader_.Failure());
    }
    if (progress == CellReader::Progress::kGoing) return std::nullopt;
    now_ = backup_;
    return NextCell();
  }
  std::optional<Outcome> OnWritten(const Answer& answer, MonoNs end) {
    const bool busy = answer.ok() && answer.reply.busy.value_or(false);
    if (busy || answer.not_taken) {
      begun_ = in_doubt_ = false;
      due_ = busy ? end + kBusyPause : 0;
      ++(busy ? busy_ : misunderstood_);
      if (busy_ < kBusyTimes && misunderstood_ < kTries) return std::nullopt;
      return WithChanges(Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                               Text("the encoder did not take the write to EEPROM %zu (%s): ", cell(),
                                    busy ? "busy" : ErrorName(*answer.error)) +
                                   Cells()));
    }
    reply_lost_ = !answer.ok();
    ReadBackAt(end + kWriteTime);
    return std::nullopt;
  }
  std::optional<Outcome> OnReadBack(const Answer& answer, MonoNs end) {
    const CellReader::Progress progress = reader_.OnAnswer(answer, end, now_);
    if (progress == CellReader::Progress::kGoing) return std::nullopt;
    if (progress == CellReader::Progress::kFailed) return NotReadBack();
    in_doubt_ = false;
    ++writes_;
    if (now_[cell()] != data_[done_]) {
      return WithChanges(
          Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                Text("EEPROM %zu reads %02X, not %02X%s: %s", cell(), unsigned{now_[cell()]},
                     unsigned{data_[done_]}, reply_lost_ ? ", the write's reply was lost" : "", Cells().c_str())));
    }
    ++done_;
    return NextCell();
  }
  std::optional<Outcome> NextCell() {
    while (done_ < data_.size() && now_[cell()] == data_[done_]) ++done_;
    if (done_ == data_.size()) {
      const std::string cells = Text("EEPROM %zu to %zu ", address_, cell() - 1);
      if (writes_ == 0) return WithChanges(Verified(cells + "held these values already: nothing was written"));
      return WithChanges(
          Verified(cells + Text("read back; %d of %zu cells were written, the others held their value", writes_,
                                data_.size())));
    }
    stage_ = Stage::kWrite;
    begun_ = false;
    busy_ = 0;
    misunderstood_ = 0;
    due_ = 0;
    Outcome running;
    running.text = Text("%zu of %zu cells hold their value", done_, data_.size());
    running.progress = static_cast<float>(done_) / static_cast<float>(data_.size());
    return WithChanges(std::move(running));
  }
  void ReadBackAt(MonoNs due) {
    stage_ = Stage::kReadBack;
    reader_ = CellReader(cell(), 1, timeout_);
    due_ = due;
  }
  [[nodiscard]] std::size_t cell() const { return address_ + done_; }
  // The backup and what the cells hold now, as far as it was read. While cells are in doubt: the rows that they are in, and
  // what a look would have found before. A row has 20 cells, and an outcome holds four changes.
  [[nodiscard]] Outcome WithChanges(Outcome outcome) const {
    constexpr std::size_t kRow = 20;
    constexpr std::size_t kRowsBesideTheFinding = 3;
    std::size_t first = 0;
    std::size_t rows = kEepromCells / kRow;
    if (outcome.state == CommandState::kRunning || outcome.state == CommandState::kIndeterminate) {
      first = address_ / kRow;
      rows = std::min((address_ + data_.size() - 1) / kRow + 1 - first, kRowsBesideTheFinding);
    }
    outcome.changes = CellChanges(first * kRow, rows * kRow, &backup_, now_);
    return WithFindingBefore(std::move(outcome), false);  // nothing is written that the cells hold already
  }
  [[nodiscard]] Outcome NotReadBack() const {
    const char* known = reply_lost_ ? "was sent, its reply was lost" : "was accepted";
    return WithChanges(Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                             Text("the write to EEPROM %zu %s, but is not known to be done: %s; %s", cell(), known,
                                  reader_.Failure().c_str(), Cells().c_str())));
  }
  // "10 to 11 hold their value, 12 begun, 13 not begun"
  [[nodiscard]] std::string Cells() const {
    std::string text;
    const auto add = [&](std::size_t first, std::size_t count, const char* what) {
      if (count == 0) return;
      text += text.empty() ? "" : ", ";
      text += count == 1 ? Text("%zu %s", first, what) : Text("%zu to %zu %s", first, first + count - 1, what);
    };
    const std::size_t begun = begun_ ? 1 : 0;
    add(address_, done_, done_ == 1 ? "holds its value" : "hold their value");
    add(cell(), begun, "begun");
    add(cell() + begun, data_.size() - done_ - begun, "not begun");
    return text;
  }

  const std::size_t address_;
  const std::vector<std::uint8_t> data_;
  const MonoNs timeout_;
  Stage stage_ = Stage::kBackup;
  CellReader reader_;
  EepromCells backup_{};
  EepromCells now_{};
  std::size_t done_ = 0;   // cells that hold their value
  int writes_ = 0;         // cells written and read back
  bool begun_ = false;     // the present cell's write was sent, and not refused
  bool in_doubt_ = false;  // likewise, and not read back yet
  bool reply_lost_ = false;
  int busy_ = 0;           // times the present cell's write was not taken
  int misunderstood_ = 0;  // likewise
  MonoNs due_ = 0;
};

using Made = Result<std::unique_ptr<Procedure>>;

std::optional<std::size_t> AddressArgument(const Arguments& arguments) {
  const auto address = WholeArgument(arguments, "address", 0, kEepromCells - 1);
  return address ? std::optional(static_cast<std::size_t>(*address)) : std::nullopt;
}

// Verifies the write that `after` names.
Made MakeEepromLook(const CommandLine& after, const TFormatSettings& settings) {
  const auto address = AddressArgument(after.arguments);
  auto data = HexArgument(after.arguments, "data");
  if (after.operation != kEepromWriteName || !address || !data || *address + data->size() > kEepromCells) {
    return BadArgument("after must be an eeprom_write with its address and data");
  }
  const std::size_t count = data->size();
  return std::make_unique<EepromRead>(*address, count, std::move(data), settings.timeout);
}

}  // namespace

Made MakeEepromWrite(const Arguments& arguments, const TFormatSettings& settings) {
  const auto address = AddressArgument(arguments);
  if (!address) return BadArgument("address must be 0 to 79");
  auto data = HexArgument(arguments, "data");
  if (!data) return BadArgument("data must be bytes in hex, two digits each, e.g. \"A1 05\"");
  if (*address + data->size() > kEepromCells) {
    return BadArgument(Text("%zu bytes from address %zu do not fit the cells 0 to 79", data->size(), *address));
  }
  for (std::size_t cell = *address; cell < *address + data->size(); ++cell) {
    if (!settings.eeprom_writable[cell]) {
      return NotPermitted(Text("the configuration does not list EEPROM address %zu in eeprom_writable", cell));
    }
  }
  return std::make_unique<EepromWrite>(*address, std::move(*data), settings.timeout);
}

Made MakeEepromRead(const Arguments& arguments, const TFormatSettings& settings) {
  if (const auto after = AfterArgument(arguments)) return MakeEepromLook(*after, settings);
  const auto address = AddressArgument(arguments);
  if (!address) return BadArgument("address must be 0 to 79");
  const auto maximum = static_cast<std::int64_t>(kEepromCells - *address);
  const auto count = ParseWhole(FindArgument(arguments, "count").value_or("1"), 1, maximum);
  if (!count) return BadArgument(Text("count must be 1 to %zu: the last cell is 79", kEepromCells - *address));
  return std::make_unique<EepromRead>(*address, static_cast<std::size_t>(*count), std::nullopt, settings.timeout);
}

Made MakeEepromBackup(const TFormatSettings& settings) {
  return std::make_unique<EepromRead>(0, kEepromCells, std::nullopt, settings.timeout);
}

}  // namespace axlecast::tformat
