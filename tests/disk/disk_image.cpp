#include "tests/disk/disk_image.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

using Kind = DiskChange::Kind;

// splitmix64 (Steele, Lea, Flood 2014): the same value for the same arguments.
std::uint64_t Mix(std::uint64_t value) {
  value += 0x9E3779B97F4A7C15ULL;
  value = (value ^ (value >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  value = (value ^ (value >> 27U)) * 0x94D049BB133111EBULL;
  return value ^ (value >> 31U);
}

void Put(std::string& bytes, std::size_t at, std::string_view part) {
  if (bytes.size() < at + part.size()) bytes.resize(at + part.size(), '\0');
  std::copy(part.begin(), part.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

void Shorten(DiskImage::Node& file, std::size_t size) {
  if (size >= file.bytes.size()) return;
  Put(file.former, size, std::string_view(file.bytes).substr(size));
  file.bytes.resize(size);
}

void Make(DiskImage::Node& file, const DiskChange& change) {
  const auto value = static_cast<std::size_t>(change.value);
  if (change.kind == Kind::kWrite) Put(file.bytes, value, change.bytes);
  if (change.kind == Kind::kMode) file.mode = change.value;
  if (change.kind != Kind::kResize) return;
  Shorten(file, value);
  file.bytes.resize(value, '\0');
}

// The two changes concern the same name.
bool Touch(const DiskChange& one, const DiskChange& other) {
  const auto names = [&other](int folder, const std::string& name) {
    return (other.folder == folder && other.name == name) ||
           (other.kind == Kind::kMove && other.to_folder == folder && other.to_name == name);
  };
  return names(one.folder, one.name) || (one.kind == Kind::kMove && names(one.to_folder, one.to_name));
}

}  // namespace

// What survives at one cut.
class DiskImage::Survival {
 public:
  enum class Fill : std::uint8_t { kZeros, kJunk, kFormer };

  Survival(const CutChoice& choice, const std::vector<std::size_t>& numbers, std::size_t last_write)
      : seed_(Mix(choice.seed)), aimed_(last_write) {
    const auto draw = [this](std::uint64_t what, std::uint64_t below) { return Mix(seed_ ^ what) % below; };
    switch (choice.kind) {
      case CutChoice::Kind::kNothing:
        rule_ = Rule::kNone;
        return;
      case CutChoice::Kind::kEverything:
        rule_ = Rule::kAll;
        return;
      case CutChoice::Kind::kTorn:
        rule_ = Rule::kFirstHalf;
        return;
      case CutChoice::Kind::kRandom:
        rule_ = static_cast<Rule>(draw(1, 4) + static_cast<std::uint64_t>(Rule::kEach));
        fill_ = static_cast<Fill>(draw(2, 3));
        share_ = 5 + 90 * draw(3, 2) + draw(4, 3) * 2;  // about 5 or 95 %
        if (draw(5, 2) == 0) share_ = 50;
        aimed_ = numbers.empty() ? 0 : numbers[draw(6, numbers.size())];
    }
  }

  // What survives of the change: its entry or its metadata (`sector` 0), or the part of its data in a sector (from 1).
  // `first` and `last`: sectors of this write.
  [[nodiscard]] bool Keeps(std::size_t number, std::size_t sector, std::size_t first, std::size_t last) const {
    switch (rule_) {
      case Rule::kNone:
        return false;
      case Rule::kAll:
        return true;
      case Rule::kFirstHalf:
        return number != aimed_ || sector == 0 || sector < first + (last - first + 1) / 2;
      case Rule::kEach:
        return Mix(seed_ ^ Mix(number * 1'000'003 + sector)) % 100 < share_;
      case Rule::kUntil:
        return number == aimed_ ? Half(number, sector) : number < aimed_;
      case Rule::kAllButOne:
        return number != aimed_ || Half(number, sector);
      case Rule::kNoneButOne:
        return number == aimed_;
    }
    return false;
  }
  [[nodiscard]] bool KeepsMetadata(std::size_t number) const { return Keeps(number, 0, 0, 0); }

  [[nodiscard]] Fill fill() const { return fill_; }
  [[nodiscard]] char Junk(std::size_t at) const { return static_cast<char>(Mix(seed_ + at / 8) >> (at % 8 * 8)); }

 private:
  enum class Rule : std::uint8_t { kNone, kAll, kFirstHalf, kEach, kUntil, kAllButOne, kNoneButOne };

  [[nodiscard]] bool Half(std::size_t number, std::size_t sector) const {
    return Mix(seed_ ^ Mix(number * 999'983 + sector)) % 2 == 0;
  }

  std::uint64_t seed_;
  Rule rule_ = Rule::kNone;
  Fill fill_ = Fill::kZeros;
  std::uint64_t share_ = 50;  // percent
  std::size_t aimed_;
};

void DiskImage::Apply(const DiskChange& change) {
  const Pending pending{count_++, &change};
  if (change.kind == Kind::kMakeFile || change.kind == Kind::kMakeFolder) {
    nodes_[change.node] = {.is_folder = change.kind == Kind::kMakeFolder, .mode = change.value};
  }
  if (change.IsEntry()) {
    entries_.push_back(pending);
  } else if (change.kind != Kind::kSync && change.kind != Kind::kSyncData) {
    files_[change.node].push_back(pending);
  } else if (nodes_[change.node].is_folder) {
    SyncFolder(change.node);
  } else {
    SyncFile(change.node, change.kind == Kind::kSyncData);
  }
}

void DiskImage::SyncFile(int node, bool data_only) {
  const auto found = files_.find(node);
  if (found == files_.end()) return;
  std::vector<Pending>& pending = found->second;
  std::size_t durable = pending.size();
  if (data_only) {
    // The last change that must be durable: a write, or a size that is not a truncation.
    std::int64_t size = static_cast<std::int64_t>(nodes_[node].bytes.size());
    durable = 0;
    for (std::size_t i = 0; i < pending.size(); ++i) {
      const DiskChange& change = *pending[i].change;
      const bool is_write = change.kind == Kind::kWrite;
      const bool grows = change.kind == Kind::kResize && change.value > size;
      if (is_write) size = std::max(size, change.value + static_cast<std::int64_t>(change.bytes.size()));
      if (change.kind == Kind::kResize) size = change.value;
      if (is_write || grows) durable = i + 1;
    }
  }
  for (std::size_t i = 0; i < durable; ++i) Make(nodes_[node], *pending[i].change);
  pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(durable));
  if (pending.empty()) files_.erase(found);
}

void DiskImage::SyncFolder(int node) {
  std::vector<bool> synced(entries_.size());
  for (std::size_t i = entries_.size(); i-- > 0;) {
    const DiskChange& change = *entries_[i].change;
    synced[i] = synced[i] || change.folder == node || (change.kind == Kind::kMove && change.to_folder == node);
    for (std::size_t j = 0; synced[i] && j < i; ++j) synced[j] = synced[j] || Touch(*entries_[j].change, change);
  }
  std::vector<Pending> rest;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (synced[i]) {
      Enter(nodes_, *entries_[i].change);
    } else {
      rest.push_back(entries_[i]);
    }
  }
  entries_ = std::move(rest);
}

void DiskImage::Enter(Nodes& nodes, const DiskChange& change) {
  auto& entries = nodes[change.folder].entries;
  if (change.kind == Kind::kRemove || change.kind == Kind::kMove) entries.erase(change.name);
  if (change.kind == Kind::kMove) {
    nodes[change.to_folder].entries[change.to_name] = change.node;
  } else if (change.kind != Kind::kRemove) {
    entries[change.name] = change.node;
  }
}

std::vector<std::size_t> DiskImage::PendingNumbers() const {
  std::vector<std::size_t> numbers;
  for (const auto& [node, pending] : files_) {
    for (const Pending& each : pending) numbers.push_back(each.number);
  }
  for (const Pending& each : entries_) numbers.push_back(each.number);
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

DiskImage::Nodes DiskImage::Cut(const CutChoice& choice) const {
  std::size_t last_write = 0;
  for (const auto& [node, pending] : files_) {
    for (const Pending& each : pending) {
      if (each.change->kind == Kind::kWrite) last_write = std::max(last_write, each.number);
    }
  }
  const Survival survival(choice, PendingNumbers(), last_write);
  Nodes nodes = nodes_;
  std::vector<bool> kept(entries_.size());
  for (std::size_t i = entries_.size(); i-- > 0;) {
    kept[i] = kept[i] || survival.KeepsMetadata(entries_[i].number);
    for (std::size_t j = 0; kept[i] && j < i; ++j)
      kept[j] = kept[j] || Touch(*entries_[j].change, *entries_[i].change);
  }
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (kept[i]) Enter(nodes, *entries_[i].change);
  }
  for (const auto& [node, pending] : files_) CutFile(nodes[node], pending, survival);
  return nodes;
}

void DiskImage::CutFile(Node& file, const std::vector<Pending>& pending, const Survival& survival) {
  const auto sectors_of = [](std::size_t size) { return (size + kSector - 1) / kSector; };
  std::size_t size = file.bytes.size();
  std::size_t fresh = sectors_of(size);  // sectors from here on have no durable content
  std::vector<bool> lost;                // sectors of which a write was lost: later ones are lost too
  std::vector<bool> written;
  const auto mark = [](std::vector<bool>& flags, std::size_t sector) {
    if (flags.size() <= sector) flags.resize(sector + 1);
    flags[sector] = true;
  };
  for (const auto& [number, change] : pending) {
    const bool kept = survival.KeepsMetadata(number);
    const auto value = static_cast<std::size_t>(change->value);
    if (change->kind == Kind::kMode) {
      if (kept) file.mode = change->value;
    } else if (change->kind == Kind::kResize) {
      if (!kept && value < std::max(size, file.bytes.size())) break;  // what follows needs this truncation
      if (!kept) continue;
      Shorten(file, value);
      size = value;
      fresh = std::min(fresh, sectors_of(value));
      if (lost.size() > sectors_of(value)) lost.resize(sectors_of(value));
      if (written.size() > sectors_of(value)) written.resize(sectors_of(value));
    } else if (!change->bytes.empty()) {
      const std::size_t end = value + change->bytes.size();
      if (kept) size = std::max(size, end);
      const std::size_t first = value / kSector;
      const std::size_t last = (end - 1) / kSector;
      for (std::size_t sector = first; sector <= last; ++sector) {
        const bool was_lost = sector < lost.size() && lost[sector];
        if (was_lost || !survival.Keeps(number, sector + 1, first + 1, last + 1)) {
          mark(lost, sector);
          continue;
        }
        const std::size_t from = std::max(value, sector * kSector);
        const std::size_t to = std::min(end, (sector + 1) * kSector);
        Put(file.bytes, from, std::string_view(change->bytes).substr(from - value, to - from));
        mark(written, sector);
      }
    }
  }
  file.bytes.resize(size, '\0');
  if (survival.fill() == Survival::Fill::kZeros) return;
  for (std::size_t sector = fresh; sector < sectors_of(size); ++sector) {
    if (sector < written.size() && written[sector]) continue;
    for (std::size_t at = sector * kSector; at < std::min(size, (sector + 1) * kSector); ++at) {
      if (survival.fill() == Survival::Fill::kJunk) {
        file.bytes[at] = survival.Junk(at);
      } else if (at < file.former.size()) {
        file.bytes[at] = file.former[at];
      }
    }
  }
}

}  // namespace axlecast
