#pragma once

#include <array>
#include <optional>

#include "drivers/saa_can/delivery.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Looks at which of two node ids an encoder answers 80 NN: first the first, then the second. The bus must be a bench's.
class NodeSearch {
 public:
  enum class Progress : std::uint8_t { kGoing, kFirst, kSecond, kNowhere };

  NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings);

  [[nodiscard]] std::optional<CanFrame> Wants() const;
  [[nodiscard]] MonoNs due() const { return due_; }
  void OnStarted(const CanFrame& frame) { delivery_.Start(frame); }
  [[nodiscard]] Progress On(const Event& event, MonoNs now);
  // Of the encoder, when it was found.
  [[nodiscard]] const Position& position() const { return position_; }

 private:
  [[nodiscard]] std::uint8_t node() const { return nodes_.at(tried_); }

  const std::array<std::uint8_t, 2> nodes_;
  const Format format_;
  const MonoNs patience_;
  std::size_t tried_ = 0;
  Delivery delivery_;
  MonoNs due_ = kNever;  // the request is out, and the answer must have come by then
  Position position_;
};

}  // namespace axlecast::saa_can
