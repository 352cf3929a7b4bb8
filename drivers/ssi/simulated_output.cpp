#include "drivers/ssi/simulated_output.h"

#include <algorithm>

namespace axlecast::ssi {

namespace {

Levels Binary(std::uint32_t value, int bits) {
  Levels levels;
  for (int bit = bits - 1; bit >= 0; --bit) levels.push_back((value >> bit & 1) != 0);
  return levels;
}

// Gray code: each bit is the exclusive or of the binary bit and the one before it.
Levels Gray(const Levels& binary) {
  Levels gray = binary;
  for (std::size_t i = 1; i < gray.size(); ++i) gray[i] = binary[i] != binary[i - 1];
  return gray;
}

Levels Joined(Levels front, const Levels& back) {
  front.insert(front.end(), back.begin(), back.end());
  return front;
}

}  // namespace

Levels SimulatedWord::Make(std::uint32_t turns, std::uint32_t counts, std::uint32_t raised) const {
  const Levels many = Binary(turns, turn_bits);
  const Levels one = Binary(counts, bits);
  Levels position = Joined(many, one);
  if (gray) position = one_gray_code ? Gray(position) : Joined(Gray(many), Gray(one));

  Levels word(static_cast<std::size_t>(length), false);
  std::copy(position.begin(), position.end(), word.begin() + position_at);
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const bool is_raised = (raised >> i & 1) != 0;
    word[static_cast<std::size_t>(flags[i].place)] = is_raised == flags[i].active_level;
  }
  if (parity_at >= 0) {
    const bool odd_so_far = std::count(word.begin(), word.end(), true) % 2 == 1;
    word[static_cast<std::size_t>(parity_at)] = odd_so_far != parity_odd;
  }
  return word;
}

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

// The level of the line after one positive edge more than `clocks`.
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
