#include "drivers/ssi/simulated_output.h"

namespace axlecast::ssi {

// "The data signal switches to Log 1 on the expiration of the monoflop time."
void SimulatedOutput::RunDown(MonoNs now) {
  if (!set_ || now < expires_) return;
  set_ = false;
  changes_.push_back({expires_, true});
}

void SimulatedOutput::Fall(MonoNs at, const std::function<Levels(MonoNs at)>& latch) {
  RunDown(at);
  if (!set_) {
    set_ = true;
    word_ = latch(at);
    clocks_ = 0;
  }
  expires_ = at + monoflop_;
}

void SimulatedOutput::Rise(MonoNs at) {
  RunDown(at);
  if (set_) changes_.push_back({at, LevelOf(clocks_++)});
}

void SimulatedOutput::Reset(MonoNs at) {
  set_ = false;
  changes_.push_back({at, true});
}

// What stands on the line after so many positive edges and one more.
bool SimulatedOutput::LevelOf(std::size_t clocks) const {
  if (clocks < word_.size()) return word_[clocks];
  switch (after_) {
    case AfterWord::kOneZero: {
      const std::size_t place = clocks % (word_.size() + 1);
      return place < word_.size() && word_[place];
    }
    case AfterWord::kNoGap:
      return word_[clocks % word_.size()];
    default:
      return false;
  }
}

bool SimulatedOutput::LevelBefore(MonoNs at) {
  RunDown(at);
  while (!changes_.empty() && changes_.front().at < at) {
    level_ = changes_.front().level;
    changes_.pop_front();
  }
  return level_;
}

}  // namespace axlecast::ssi
