#include "drivers/runtime/command/datum_order.h"

#include <axlecast/command_status_t.hpp>
#include <charconv>
#include <cmath>

namespace axlecast {
namespace {

using Status = command_status_t;

// Beyond it a double no longer tells neighbouring counts apart, and sums could leave 64 bits.
constexpr double kLargestDatum = 9.0e15;

template <typename Number>
std::optional<Number> Parse(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (!(std::abs(static_cast<double>(number)) <= kLargestDatum)) return std::nullopt;  // NaN, too
  return number;
}

const std::string* Find(const DriverCommand& order, std::string_view key) {
  for (const auto& [name, value] : order.arguments) {
    if (name == key) return &value;
  }
  return nullptr;
}

std::string DatumText(const std::optional<Reference::Datum>& datum) {
  return datum ? std::to_string(datum->counts) : "none";
}

}  // namespace

std::string ValueText(double value) {
  if (std::isnan(value)) return "";
  char text[32];
  const auto [end, error] = std::to_chars(std::begin(text), std::end(text), value);
  return error == std::errc() ? std::string(text, end) : std::string();
}

DatumOrder::DatumOrder(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime) {
  const DevicePublisher::Summary now = channel.summary();
  value_before_ = now.value;
  datum_before_ = now.datum;
  file_datum_ = now.file_datum;
  identity_ = now.identity;
  if (order.operation == "set_datum") {
    kind_ = Kind::kSet;
    JudgeSet(channel, order, utime);
  } else if (order.operation == "clear_datum") {
    kind_ = Kind::kClear;
    JudgeClear();
    value_after_ = channel.ValueWith(file_datum_ ? file_datum_->counts : 0);
  }
}

void DatumOrder::Refuse(std::int32_t reason, std::string text) {
  if (refusal_) return;
  refusal_ = Outcome{.state = CommandState::kRejected, .reason = reason, .text = std::move(text), .changes = {}};
}

void DatumOrder::JudgeSet(const DevicePublisher& channel, const DriverCommand& order, std::int64_t utime) {
  const std::string* const value = Find(order, "value");
  const std::string* const counts = Find(order, "counts");
  if ((value == nullptr) == (counts == nullptr)) {
    return Refuse(Status::REASON_BAD_ARGUMENT, "set_datum takes exactly one of value and counts");
  }
  datum_.utime = utime;
  if (const std::string* const established = Find(order, "utime")) {
    const auto given = Parse<std::int64_t>(*established);
    if (!given || *given < 0) {
      return Refuse(Status::REASON_BAD_ARGUMENT, "utime is no UNIX time in whole microseconds");
    }
    dated_ = true;
    datum_.utime = *given;
  }
  if (const std::string* const wanted = Find(order, "identity"); wanted != nullptr && !wanted->empty()) {
    JudgeIdentity(*wanted);
  }
  if (value != nullptr) return JudgeCounts(channel, "value", *value);
  JudgeCounts(channel, "counts", *counts);
}

void DatumOrder::JudgeIdentity(const std::string& wanted) {
  if (identity_.empty()) {
    return Refuse(Status::REASON_DEVICE_OFFLINE,
                  "the encoder has not told its identity yet, " + wanted + " is expected: repeat it when online");
  }
  if (identity_ == wanted) return;
  Refuse(Status::REASON_WRONG_IDENTITY, "the encoder is " + identity_ + ", and the datum is for " + wanted +
                                            ": accept the exchange, then set the datum anew");
}

void DatumOrder::JudgeCounts(const DevicePublisher& channel, const std::string& key, const std::string& text) {
  const auto number = Parse<double>(text);
  if (!number) return Refuse(Status::REASON_BAD_ARGUMENT, key + " is no number within +-9e15");
  if (key == "counts") {
    datum_.counts = static_cast<std::int64_t>(*number);
    if (static_cast<double>(datum_.counts) != *number) {
      return Refuse(Status::REASON_BAD_ARGUMENT, "counts is no whole number");
    }
  } else {
    const auto datum = channel.DatumFor(*number);
    if (!datum) return Refuse(Status::REASON_DEVICE_OFFLINE, "no valid position is known yet");
    datum_.counts = *datum;
  }
  // With an older datum the encoder's turns are counted anew from it.
  if (!dated_) value_after_ = channel.ValueWith(datum_.counts);
}

void DatumOrder::JudgeClear() {
  if (!datum_before_) {
    return Refuse(Status::REASON_NO_DATUM, "no datum is in force: there is nothing to clear");
  }
  if (datum_before_ != file_datum_) return;
  Refuse(Status::REASON_NOT_PERMITTED, "the datum in force, " + DatumText(datum_before_) +
                                           " counts, is of the machine's file: take datum_counts out there");
}

std::optional<Reference::Datum> DatumOrder::DatumAfter() const {
  return kind_ == Kind::kSet ? datum_ : file_datum_;
}

std::vector<Change> DatumOrder::Changes(std::string value_after) const {
  return {{"value", ValueText(value_before_), std::move(value_after)},
          {"datum_counts", DatumText(datum_before_), DatumText(DatumAfter())},
          {"identity", "", identity_}};
}

Outcome DatumOrder::Prepared() const {
  Outcome outcome{.state = CommandState::kSucceeded, .changes = {}};
  if (kind_ == Kind::kMarkLost) {
    outcome.text = "would mark the reference as lost";
    return outcome;
  }
  outcome.text = kind_ == Kind::kSet ? "would set the datum to " + DatumText(datum_) + " counts"
                                     : "would clear the datum, " + DatumText(datum_before_) + " counts";
  outcome.changes = Changes(value_after_ ? ValueText(*value_after_) : "");
  return outcome;
}

Outcome DatumOrder::Apply(DevicePublisher& channel) const {
  Outcome outcome{.state = CommandState::kSucceeded, .verified = true, .changes = {}};
  if (kind_ == Kind::kMarkLost) {
    channel.OnReferenceLost();
    outcome.text = "the reference is marked as lost";
    return outcome;
  }
  if (kind_ == Kind::kSet) {
    channel.SetDatum(datum_.counts, datum_.utime);
    outcome.text = "datum set to " + std::to_string(datum_.counts) + " counts";
  } else {
    channel.ClearDatum();
    outcome.text = file_datum_ ? "the datum of the machine's file is in force again" : "the datum is cleared";
  }
  outcome.changes = Changes(ValueText(channel.summary().value));
  return outcome;
}

}  // namespace axlecast
