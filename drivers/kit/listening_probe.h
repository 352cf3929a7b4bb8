#pragma once

#include <algorithm>
#include <optional>

#include "core/device/probe.h"

namespace axlecast {

// A probe that listens from `now` for `duration` and transmits nothing. It ends early when the link goes down.
class ListeningProbe : public Probe {
 public:
  ListeningProbe(MonoNs now, MonoNs duration) : begin_(now), duration_(duration), now_(now) {}

  [[nodiscard]] std::optional<Step> Next(MonoNs now) const final {
    if (lost_ || now >= begin_ + duration_) return std::nullopt;
    return Step{.action = Listen{begin_ + duration_}};
  }
  void On(const Event& event) final {
    lost_ = lost_ || event.kind == Event::Kind::kLinkDown;
    now_ = std::max(now_, event.received.last);
    Take(event);
  }
  [[nodiscard]] double Progress() const final {
    return static_cast<double>(std::clamp<MonoNs>(now_ - begin_, 0, duration_)) / static_cast<double>(duration_);
  }

 protected:
  virtual void Take(const Event& event) = 0;
  [[nodiscard]] MonoNs begin() const { return begin_; }

 private:
  MonoNs begin_;
  MonoNs duration_;
  MonoNs now_;
  bool lost_ = false;
};

}  // namespace axlecast
