#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bridge/store/sqlite_store.h"
#include "core/command/commands.h"
#include "core/messages/enum_names.h"
#include "tests/disk/memory_folder.h"
#include "tests/power_cuts/power_cuts.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kStart = 1'700'000'000'000'000;  // us, UNIX time
constexpr const char* kFile = "/state/press3/journal.db";
constexpr const char* kMachine = "press3";

// All that a journal contains, as text. Nothing if it cannot be read. `check`: SQLite checks its pages too.
std::string Dump(const std::string& file, bool check = false) {
  const auto opened = Database::Open(file, Database::Access::kReadOnly);
  if (!opened) return "";
  Database& database = **opened;
  std::string text;
  const auto add = [&](const char* sql, int columns) {
    Rows rows = database.Select(sql);
    while (rows.Next()) {
      for (int i = 0; i < columns; ++i) text += rows.Text(i) + '|';
      text += '\n';
    }
  };
  add("SELECT 'c', number, id, device, driver_boot_id, sent_epoch, state, verified, finding, text, progress, "
      "changes "
      "FROM commands ORDER BY number",
      12);
  add("SELECT 's', number, command, utime, state, text, progress FROM steps ORDER BY number", 7);
  add("SELECT 'd', number, device, counts, value, command, voided_utime FROM datums ORDER BY number", 7);
  add("SELECT 'a', device, identity, reference_lost, writes, position_counts, position_utime, datum FROM axes "
      "ORDER BY device",
      8);
  add("SELECT 'm', device, kind, alarm, utime, who FROM alarm_marks ORDER BY device, kind, alarm", 6);
  add("SELECT 'e', number, utime, device, kind, text FROM events ORDER BY number", 6);
  add("SELECT 'k', key, value FROM meta WHERE key NOT IN ('journal_id', 'probe') ORDER BY key", 3);
  if (check) {
    Rows rows = database.Select("PRAGMA quick_check");
    if (!rows.Next() || rows.Text(0) != "ok") text = "damaged: " + rows.Text(0);
  }
  return database.result() ? text : "";
}

// What a journal must contain: after each operation, and from which point of the disk on.
struct Promise {
  std::size_t begun = 0;     // the operation was called
  std::size_t done = 0;      // and had returned
  std::string content = {};  // Dump
  std::int64_t epoch = 0;    // highest that was given so far
};

// Writes a journal and notes what it then must contain.
class Workload {
 public:
  Workload(RecordedDisk& disk, std::string folder, std::string copy, PlantedFault fault)
      : disk_(disk), folder_(std::move(folder)), copy_(std::move(copy)), fault_(fault) {}

  void Open() {
    Do([&] { store_ = std::make_unique<SqliteStore>(folder_ + kFile, kMachine); });
  }
  void Close() {
    Do([&] { store_.reset(); });
  }
  // One operation as the bridge would do it.
  void Operate(std::mt19937_64& random, int restarts) {
    now_ += 50'000'000;
    if (random() % static_cast<std::uint64_t>(restarts) == 0) {
      Close();
      Open();
    } else {
      Do([&] { Choose(random); });
    }
  }
  void Reserve() {
    Do([&] { ReserveEpochs(10); });
  }
  void Accept() {
    Do([&] { AcceptCommand(); });
  }

  [[nodiscard]] const std::vector<Promise>& promises() const { return promises_; }
  [[nodiscard]] SqliteStore& store() { return *store_; }
  // Continues a journal from which epochs were given up to `epoch`.
  void Begin(std::int64_t epoch) {
    promises_.emplace_back();
    promises_.back().epoch = epoch;
    epoch_ = epoch;
    commands_ = 1'000'000;
  }
  [[nodiscard]] const std::string& failure() const { return failure_; }

 private:
  template <typename Operation>
  void Do(const Operation& operation) {
    Promise promise;
    promise.begun = disk_.position();
    operation();
    promise.done = disk_.position();
    promise.epoch = epoch_;
    disk_.Cut(promise.done, {CutChoice::Kind::kEverything}, copy_);
    promise.content = Dump(copy_ + kFile);
    if (fault_ == PlantedFault::kEarlyClaim) promise.done = promise.begun;
    promises_.push_back(std::move(promise));
  }

  void Expect(bool good, const char* what) {
    if (!good && failure_.empty()) failure_ = what;
  }
  [[nodiscard]] Timestamp Now() const { return {now_, kStart + now_ / 1'000}; }

  void AcceptCommand() {
    CommandRecord record;
    const std::uint32_t number = ++commands_;
    for (std::size_t i = 0; i < 4; ++i) record.status.id[i] = static_cast<std::uint8_t>(number >> (8 * i));
    record.status.device = "axis" + std::to_string(number % 3);
    record.status.operation = "set_datum";
    record.status.state = S::STATE_ACCEPTED;
    record.who = "plc";
    record.reason = std::string(number * 37 % 160, 'r');
    record.utime = Now().utime;
    Expect(store_->Accepted(record, Now()), "a command is not accepted");
    open_.push_back(record.status);
  }
  void ReserveEpochs(std::int64_t count) {
    const std::int64_t first = store_->ReserveEpochs(1, count);
    Expect(first > epoch_, "an epoch was given twice");
    epoch_ = first + count - 1;
  }
  S Move(std::size_t at, std::int8_t state) {
    S status = open_[at];
    status.state = state;
    status.is_final = IsFinalState(state) ? 1 : 0;
    status.text = std::string(StateName(state)) + ' ' + std::to_string(now_);
    open_[at] = status;
    if (status.is_final != 0) open_.erase(open_.begin() + static_cast<std::ptrdiff_t>(at));
    return status;
  }
  void ChangeDevice(std::mt19937_64& random) {
    const std::string device = "axis" + std::to_string(random() % 3);
    const std::int64_t utime = Now().utime;
    DeviceChange change;
    switch (random() % 8) {
      case 0:
      case 1:
        change = DatumRecord{.counts = now_, .utime = utime, .value = "12 mm", .who = "plc", .reason = "homing"};
        break;
      case 2:
        change = DatumVoided{utime, "moved"};
        break;
      case 3:
        change = WritesAdded{1, utime};
        break;
      case 4:
        change = ReferenceChanged{random() % 2 == 0};
        break;
      case 5:
        change = IdentityChanged{"S" + std::to_string(random() % 3)};
        break;
      case 6:
        change = EncoderExchanged{"X" + std::to_string(now_), utime};
        break;
      default:
        if (random() % 3 == 0) {
          change = AlarmMarkEnded{AlarmMark::Kind::kShelved, "a" + std::to_string(random() % 3)};
        } else {
          change = AlarmMark{.kind = AlarmMark::Kind::kShelved,
                             .alarm = "a" + std::to_string(random() % 3),
                             .utime = utime,
                             .who = "anna"};
        }
    }
    Expect(store_->Apply(device, change), "a change of a device is not made");
  }
  void Choose(std::mt19937_64& random) {
    const std::uint64_t what = random() % 12;
    const std::size_t at = open_.empty() ? 0 : random() % open_.size();
    if (what < 3 || open_.empty()) return AcceptCommand();
    if (what == 3) {
      S status = Move(at, S::STATE_RUNNING);
      status.driver_boot_id = 77;
      Expect(store_->Routed(status, epoch_, Now()), "a command cannot be routed");
    } else if (what == 4) {
      store_->Step(Move(at, S::STATE_RUNNING), Now());
      store_->Tick(Now());
    } else if (what < 7) {
      store_->Outcome(Move(at, S::STATE_SUCCEEDED), Now());
      Expect(store_->state().has_value(), "an outcome is not written");
    } else if (what == 7) {
      ReserveEpochs(static_cast<std::int64_t>(random() % 100 + 1));
    } else if (what == 8) {
      store_->KeepPosition("axis1", {now_, Now().utime});
      store_->Tick(Now());
    } else if (what == 9) {
      store_->Note({.utime = Now().utime, .device = "axis1", .kind = "moved", .text = std::to_string(now_)});
    } else {
      ChangeDevice(random);
    }
  }

  RecordedDisk& disk_;
  const std::string folder_;
  const std::string copy_;
  const PlantedFault fault_;
  std::unique_ptr<SqliteStore> store_;
  MonoNs now_ = 0;
  std::uint32_t commands_ = 0;
  std::int64_t epoch_ = 0;
  std::vector<S> open_;
  std::vector<Promise> promises_;
  std::string failure_;
};

// The promises that hold after a cut: from the last operation that had returned, to the last that was called.
struct Range {
  std::size_t first = 0;
  std::size_t last = 0;
};
Range Held(const std::vector<Promise>& promises, std::size_t point) {
  Range range;
  for (std::size_t i = 0; i < promises.size(); ++i) {
    if (promises[i].done <= point) range.first = i;
    if (promises[i].begun < point) range.last = i;
  }
  range.last = std::max(range.first, range.last);
  return range;
}

class JournalCheck {
 public:
  JournalCheck(const CutOrder& order, CutTally& tally) : order_(order), tally_(tally) {}

  void Run() {
    const std::string live = memory_.path() + "/live";
    std::filesystem::create_directory(live);
    RecordedDisk disk(live);
    Plant(disk, order_.fault);
    Workload workload(disk, live, memory_.path() + "/copy", order_.fault);
    std::mt19937_64 random(order_.seed);
    workload.Open();
    for (int i = 0; i < order_.operations; ++i) workload.Operate(random, order_.restarts);
    workload.Close();
    if (!workload.failure().empty()) return tally_.Breach(workload.failure());
    CutEverywhere(
        disk, order_, memory_.path() + "/cut",
        [&](std::size_t point, const std::string& folder) {
          const bool again = order_.second_cuts > 0 && ++checks_ % order_.second_cuts == 0;
          return Check(workload.promises(), point, folder, again);
        },
        tally_);
  }

 private:
  // Starts a bridge's store on the state, and checks and uses it.
  std::string Check(const std::vector<Promise>& promises, std::size_t point, const std::string& folder,
                    bool again) {
    const Range held = Held(promises, point);
    if (again) return CutRecovery(promises, held, folder);
    // Three states of four are only read (as by axlecast history), which takes less time: SQLite recovers the file for a reader
    // as for the bridge.
    const bool exists = promises[0].done <= point && !promises[0].content.empty();
    if (exists && tally_.states % 4 != 0) return Compare(promises, held, Dump(folder + kFile));
    SqliteStore store(folder + kFile, kMachine);
    if (!store.state()) return "the journal cannot be used: " + store.state().error().text;
    std::string breach = Compare(promises, held, Dump(folder + kFile, true));
    if (!breach.empty()) return breach;
    const std::int64_t epoch = store.ReserveEpochs(1, 10);
    return epoch > promises[held.first].epoch ? "" : "epoch " + std::to_string(epoch) + " was given before";
  }

  // The power is cut again while the store recovers the journal and is used.
  std::string CutRecovery(const std::vector<Promise>& promises, Range held, const std::string& folder) {
    RecordedDisk disk(folder);
    Workload workload(disk, folder, memory_.path() + "/copy", PlantedFault::kNone);
    workload.Begin(promises[held.first].epoch);
    workload.Open();
    const std::string content = workload.promises().back().content;
    const Result<> usable = workload.store().state();
    if (!usable) return "the journal cannot be used: " + usable.error().text;
    std::string breach = Compare(promises, held, content);
    if (!breach.empty()) return breach;
    workload.Accept();
    workload.Reserve();
    workload.Close();
    if (!workload.failure().empty()) return "after the recovery: " + workload.failure();
    std::vector<Promise> recovered = workload.promises();
    recovered[0].content = content;
    recovered[0].done = SIZE_MAX;  // it may still be at its first opening
    std::mt19937_64 random(order_.seed + static_cast<std::uint64_t>(tally_.states));
    for (int i = 0; i < 3 && breach.empty(); ++i) {
      const std::size_t point = random() % (disk.position() + 1);
      const CutChoice choice{CutChoice::Kind::kRandom, random()};
      disk.Cut(point, choice, memory_.path() + "/second");
      ++tally_.states;
      ++tally_.second_cuts;
      breach = Check(recovered, point, memory_.path() + "/second", false);
      if (!breach.empty()) breach = "after a second cut, " + std::to_string(point) + ": " + breach;
    }
    return breach;
  }

  static std::string Compare(const std::vector<Promise>& promises, Range held, const std::string& content) {
    for (std::size_t i = held.first; i <= held.last; ++i) {
      if (promises[i].content == content) return "";
    }
    return Difference(promises, held, content);
  }

  static std::string Difference(const std::vector<Promise>& promises, Range held, const std::string& content) {
    for (std::size_t i = 0; i < held.first; ++i) {
      if (promises[i].content == content) {
        return "the journal is as after operation " + std::to_string(i) + ", but " + std::to_string(held.first) +
               " had returned";
      }
    }
    return "the journal is as after no operation; expected one of " + std::to_string(held.first) + " to " +
           std::to_string(held.last) + "\n" + promises[held.first].content + "--- but it is\n" + content;
  }

  const CutOrder order_;
  CutTally& tally_;
  const MemoryFolder memory_;
  std::size_t checks_ = 0;
};

}  // namespace

CutTally CutJournal(const CutOrder& order) {
  CutTally tally;
  JournalCheck(order, tally).Run();
  return tally;
}

}  // namespace axlecast
