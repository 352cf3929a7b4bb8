#include "drivers/saa_can/node_search.h"

#include <algorithm>

namespace axlecast::saa_can {
namespace {

constexpr MonoNs kPatience = 500 * kMillisecond;
constexpr int kPeriods = 4;

}  // namespace

NodeSearch::NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings)
    : nodes_{first, second},
      format_(settings.format),
      patience_(std::max({kPatience, settings.timeout, kPeriods * settings.period})) {}

std::optional<CanFrame> NodeSearch::Wants() const {
  if (delivery_.state() != Delivery::State::kIdle) return std::nullopt;
  return CommandFrame(Command::kRead, node());
}

NodeSearch::Progress NodeSearch::On(const Event& event, MonoNs now) {
  if (delivery_.state() == Delivery::State::kIdle) return Progress::kGoing;
  delivery_.On(event, now);
  if (due_ == kNever) due_ = now + patience_;
  if (event.kind == Event::Kind::kFrame && event.id == DataId(node())) {
    position_ = ParsePosition(event.bytes, format_);
    return tried_ == 0 ? Progress::kFirst : Progress::kSecond;
  }
  if (now < due_) return Progress::kGoing;
  if (tried_ + 1 == nodes_.size()) return Progress::kNowhere;
  ++tried_;
  delivery_ = {};
  due_ = kNever;
  return Progress::kGoing;
}

}  // namespace axlecast::saa_can
