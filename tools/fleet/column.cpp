#include "tools/fleet/column.h"

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <cassert>
#include <optional>

#include "core/base/text.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::size_t kColumnHeader = 7;               // id, mode, width, size
constexpr std::size_t kRunSize = 10;                   // length, value
constexpr std::uint64_t kMaxSpan = UINT64_C(1) << 52;  // of a line
constexpr std::size_t kEscaped = 8;                    // bytes behind an escape

// Arithmetic modulo 2^64: exact in both directions for any values.
std::uint64_t Word(std::int64_t value) { return static_cast<std::uint64_t>(value); }
std::int64_t Number(std::uint64_t value) { return static_cast<std::int64_t>(value); }

std::uint64_t Zigzag(std::uint64_t value) { return (value << 1U) ^ Word(Number(value) >> 63); }
std::uint64_t Unzigzag(std::uint64_t value) { return (value >> 1U) ^ (0 - (value & 1U)); }

// The points first + (last - first) x i / (steps), rounded toward first, one after another.
class Line {
 public:
  // Returns nothing for two values that are too far apart.
  static std::optional<Line> Between(std::int64_t first, std::int64_t last, std::size_t steps) {
    std::int64_t span = 0;
    if (steps == 0 || __builtin_sub_overflow(last, first, &span)) return std::nullopt;
    const std::uint64_t size = span < 0 ? 0 - Word(span) : Word(span);
    if (size >= kMaxSpan) return std::nullopt;
    return Line(Word(first), size, span < 0, steps);
  }

  // Returns the next point, beginning with `first`.
  std::uint64_t Next() {
    const std::uint64_t point = falls_ ? first_ - offset_ : first_ + offset_;
    offset_ += whole_;
    rest_ += fraction_;
    if (rest_ >= steps_) {
      rest_ -= steps_;
      ++offset_;
    }
    return point;
  }

 private:
  Line(std::uint64_t first, std::uint64_t size, bool falls, std::uint64_t steps)
      : first_(first), falls_(falls), steps_(steps), whole_(size / steps), fraction_(size % steps) {}

  std::uint64_t first_;
  bool falls_;
  std::uint64_t steps_;
  std::uint64_t whole_;     // of a step
  std::uint64_t fraction_;  // of a step, in parts of steps_
  std::uint64_t offset_ = 0;
  std::uint64_t rest_ = 0;
};

// The zigzag residuals of one mode, and the form in which they are smallest.
class Residuals {
 public:
  void Add(std::uint64_t residual) {
    const std::uint64_t value = Zigzag(residual);
    values_[size_++] = value;
    bits_ |= value;
    beyond_one_ += value >= 0xFF ? 1U : 0U;
    beyond_two_ += value >= 0xFFFF ? 1U : 0U;
  }

  struct Form {
    std::uint8_t width;
    std::size_t bytes;
  };
  [[nodiscard]] Form Smallest() const {
    if (bits_ == 0) return {0, 0};
    Form best{1, size_ + kEscaped * beyond_one_};
    const auto consider = [&best](Form form) { best = form.bytes < best.bytes ? form : best; };
    consider({2, 2 * size_ + kEscaped * beyond_two_});
    if (bits_ <= UINT32_MAX) consider({4, 4 * size_});
    consider({8, 8 * size_});
    return best;
  }

  void Append(std::vector<std::uint8_t>& body, std::uint8_t width) const {
    for (std::size_t i = 0; i < size_; ++i) {
      const std::uint64_t value = values_[i];
      switch (width) {
        case 0:
          break;
        case 1:
          AppendBigEndian(body, static_cast<std::uint8_t>(std::min<std::uint64_t>(value, 0xFF)));
          if (value >= 0xFF) AppendBigEndian(body, value);
          break;
        case 2:
          AppendBigEndian(body, static_cast<std::uint16_t>(std::min<std::uint64_t>(value, 0xFFFF)));
          if (value >= 0xFFFF) AppendBigEndian(body, value);
          break;
        case 4:
          AppendBigEndian(body, static_cast<std::uint32_t>(value));
          break;
        default:
          AppendBigEndian(body, value);
      }
    }
  }

 private:
  std::array<std::uint64_t, kMaxChunkSamples> values_;  // the first size_ are set
  std::size_t size_ = 0;
  std::uint64_t bits_ = 0;
  std::size_t beyond_one_ = 0;
  std::size_t beyond_two_ = 0;
};

using Values = std::span<const std::int64_t>;

bool LinearResiduals(Values values, Residuals& residuals) {
  auto line = Line::Between(values.front(), values.back(), values.size() - 1);
  if (!line) return false;
  for (const std::int64_t value : values) residuals.Add(Word(value) - line->Next());
  return true;
}

void DeltaResiduals(Values values, Residuals& residuals) {
  for (std::size_t i = 1; i < values.size(); ++i) residuals.Add(Word(values[i]) - Word(values[i - 1]));
}

void DeltaOfDeltaResiduals(Values values, Residuals& residuals) {
  for (std::size_t i = 2; i < values.size(); ++i) {
    residuals.Add(Word(values[i]) - 2 * Word(values[i - 1]) + Word(values[i - 2]));
  }
}

std::size_t CountRuns(Values values) {
  std::size_t runs = 1;
  for (std::size_t i = 1; i < values.size(); ++i) runs += values[i] != values[i - 1] ? 1U : 0U;
  return runs;
}

void AppendRuns(std::vector<std::uint8_t>& body, Values values) {
  for (std::size_t begin = 0; begin < values.size();) {
    std::size_t end = begin + 1;
    while (end < values.size() && values[end] == values[begin]) ++end;
    AppendBigEndian(body, static_cast<std::uint16_t>(end - begin));
    AppendBigEndian(body, Word(values[begin]));
    begin = end;
  }
}

// The smallest form so far.
struct Choice {
  ColumnMode mode = ColumnMode::kRuns;
  std::uint8_t width = 0;
  std::size_t bytes = 0;
  const Residuals* residuals = nullptr;

  void Consider(ColumnMode other, std::size_t head, const Residuals& of) {
    const Residuals::Form form = of.Smallest();
    if (head + form.bytes >= bytes) return;
    *this = {.mode = other, .width = form.width, .bytes = head + form.bytes, .residuals = &of};
  }
};

// Reads residuals of one width, one after another.
class ResidualReader {
 public:
  ResidualReader(Bytes data, std::uint8_t width) : data_(data), width_(width) {}

  // Returns nothing if the data ends before.
  std::optional<std::uint64_t> Next() {
    if (data_.size() < width_) return std::nullopt;
    std::uint64_t value = Read(width_);
    const bool escape = (width_ == 1 && value == 0xFF) || (width_ == 2 && value == 0xFFFF);
    if (escape) {
      if (data_.size() < kEscaped) return std::nullopt;
      value = Read(kEscaped);
    }
    return Unzigzag(value);
  }
  [[nodiscard]] bool AtEnd() const { return data_.empty(); }

 private:
  std::uint64_t Read(std::size_t size) {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : data_.first(size)) value = value << 8U | byte;
    data_ = data_.subspan(size);
    return value;
  }

  Bytes data_;
  std::uint8_t width_;
};

tl::unexpected<Error> Broken(const ColumnView& column, const char* why) {
  return Failure(
      Text("the column %d of a chunk %s: the row was damaged, or a newer version wrote it", column.id, why));
}

Result<std::vector<std::int64_t>> DecodeRuns(const ColumnView& column, std::size_t n) {
  if (column.width != 0 || column.data.size() % kRunSize != 0) return Broken(column, "has a run that is cut");
  std::vector<std::int64_t> values;
  values.reserve(n);
  for (std::size_t at = 0; at < column.data.size(); at += kRunSize) {
    const std::size_t length = ReadBigEndian<std::uint16_t>(column.data, at);
    if (length == 0 || length > n - values.size()) return Broken(column, "has a run of a wrong length");
    values.insert(values.end(), length, Number(ReadBigEndian<std::uint64_t>(column.data, at + 2)));
  }
  if (values.size() != n) return Broken(column, "has too few values");
  return values;
}

// Decodes the values behind the first ones, which `next` computes from the residual and the values so far.
template <typename Next>
Result<std::vector<std::int64_t>> DecodeResiduals(const ColumnView& column, Bytes data, std::size_t n,
                                                  std::vector<std::int64_t> values, Next next) {
  values.reserve(n);
  ResidualReader reader(data, column.width);
  while (values.size() < n) {
    const auto residual = reader.Next();
    if (!residual) return Broken(column, "has too few values");
    values.push_back(Number(next(*residual, values)));
  }
  if (!reader.AtEnd()) return Broken(column, "has bytes behind its values");
  return values;
}

Result<std::vector<std::int64_t>> DecodeLinear(const ColumnView& column, std::size_t n) {
  auto line = Line::Between(Number(ReadBigEndian<std::uint64_t>(column.data, 0)),
                            Number(ReadBigEndian<std::uint64_t>(column.data, 8)), n - 1);
  if (!line) return Broken(column, "has a line that is too steep, or of one value");
  return DecodeResiduals(column, column.data.subspan(16), n, {},
                         [&line](std::uint64_t residual, const auto&) { return line->Next() + residual; });
}

Result<std::vector<std::int64_t>> DecodeDelta(const ColumnView& column, std::size_t n) {
  const std::int64_t first = Number(ReadBigEndian<std::uint64_t>(column.data, 0));
  return DecodeResiduals(column, column.data.subspan(8), n, {first},
                         [](std::uint64_t residual, const auto& values) { return Word(values.back()) + residual; });
}

Result<std::vector<std::int64_t>> DecodeDeltaOfDelta(const ColumnView& column, std::size_t n) {
  if (n < 2) return Broken(column, "has a difference, but one value");
  const std::uint64_t first = ReadBigEndian<std::uint64_t>(column.data, 0);
  const std::uint64_t second = first + ReadBigEndian<std::uint64_t>(column.data, 8);
  return DecodeResiduals(column, column.data.subspan(16), n, {Number(first), Number(second)},
                         [](std::uint64_t residual, const auto& values) {
                           return 2 * Word(values.back()) - Word(values[values.size() - 2]) + residual;
                         });
}

}  // namespace

void BeginBody(std::vector<std::uint8_t>& body, std::size_t columns) {
  body.push_back(kBodyVersion);
  body.push_back(static_cast<std::uint8_t>(columns));
}

void AppendColumn(std::vector<std::uint8_t>& body, ColumnId id, std::span<const std::int64_t> values) {
  assert(!values.empty() && values.size() <= kMaxChunkSamples);
  const std::size_t runs = CountRuns(values);
  Choice choice{.bytes = kRunSize * runs};
  Residuals delta;
  DeltaResiduals(values, delta);
  choice.Consider(ColumnMode::kDelta, 8, delta);
  Residuals linear;
  Residuals delta_of_delta;
  if (runs > 1) {  // equal values are smallest as deltas
    DeltaOfDeltaResiduals(values, delta_of_delta);
    choice.Consider(ColumnMode::kDeltaOfDelta, 16, delta_of_delta);
    if (LinearResiduals(values, linear)) choice.Consider(ColumnMode::kLinear, 16, linear);
  }

  body.reserve(body.size() + kColumnHeader + choice.bytes);
  body.push_back(static_cast<std::uint8_t>(id));
  body.push_back(static_cast<std::uint8_t>(choice.mode));
  body.push_back(choice.width);
  AppendBigEndian(body, static_cast<std::uint32_t>(choice.bytes));
  if (choice.mode == ColumnMode::kRuns) return AppendRuns(body, values);
  AppendBigEndian(body, Word(values.front()));
  if (choice.mode == ColumnMode::kLinear) AppendBigEndian(body, Word(values.back()));
  if (choice.mode == ColumnMode::kDeltaOfDelta) AppendBigEndian(body, Word(values[1]) - Word(values[0]));
  choice.residuals->Append(body, choice.width);
}

Result<std::vector<ColumnView>> SplitBody(Bytes body) {
  const auto broken = [](const char* why) {
    return Failure(Text("the body of a chunk %s: the row was damaged", why));
  };
  if (body.size() < 2) return broken("has no head");
  if (body[0] != kBodyVersion) {
    return Failure(
        Text("the body of a chunk has version %d, and this program reads version %d: use a newer axlecast", body[0],
             kBodyVersion));
  }
  std::vector<ColumnView> columns;
  std::bitset<256> ids;
  Bytes rest = body.subspan(2);
  for (std::size_t i = 0; i < body[1]; ++i) {
    if (rest.size() < kColumnHeader) return broken("ends within a column");
    const std::size_t size = ReadBigEndian<std::uint32_t>(rest, 3);
    if (rest.size() - kColumnHeader < size) return broken("ends within a column");
    if (ids.test(rest[0])) return broken("has a column twice");
    ids.set(rest[0]);
    columns.push_back(
        {.id = rest[0], .mode = rest[1], .width = rest[2], .data = rest.subspan(kColumnHeader, size)});
    rest = rest.subspan(kColumnHeader + size);
  }
  if (!rest.empty()) return broken("has bytes behind its columns");
  return columns;
}

Result<std::vector<std::int64_t>> DecodeColumn(const ColumnView& column, std::size_t n) {
  if (n == 0 || n > kMaxChunkSamples) return Broken(column, Text("cannot have %zu values", n).c_str());
  const auto mode = static_cast<ColumnMode>(column.mode);
  if (mode == ColumnMode::kRuns) return DecodeRuns(column, n);
  if (column.mode > static_cast<std::uint8_t>(ColumnMode::kRuns)) return Broken(column, "has an unknown mode");
  if (column.width > 8 || std::popcount(column.width) > 1) return Broken(column, "has an unknown width");
  if (column.data.size() < (mode == ColumnMode::kDelta ? 8U : 16U))
    return Broken(column, "ends within its first values");
  if (mode == ColumnMode::kLinear) return DecodeLinear(column, n);
  return mode == ColumnMode::kDelta ? DecodeDelta(column, n) : DecodeDeltaOfDelta(column, n);
}

}  // namespace axlecast
