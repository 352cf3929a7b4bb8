// Any transfer and any format: the codec must not crash, and what it accepts must be what an encoder at that position
// would have sent, made by the simulator's own code.
#include <fuzzer/FuzzedDataProvider.h>

#include <cstdlib>

#include "drivers/kit/clocked_line.h"
#include "drivers/ssi/codec.h"
#include "drivers/ssi/simulator.h"

namespace axlecast::ssi {
namespace {

void Require(bool holds) {
  if (!holds) std::abort();
}

Format AnyFormat(FuzzedDataProvider& input) {
  Format format;
  const int used = input.ConsumeIntegralInRange(1, kMaxPositionBits);
  format.bits = input.ConsumeIntegralInRange(1, used);
  format.turn_bits = used - format.bits;
  if (input.ConsumeBool() && format.bits <= kTreeBits && format.turn_bits <= kTreeTurnBits) {
    format = TreeFormat(format.turn_bits, format.bits);
  } else {
    format.word_bits = input.ConsumeIntegralInRange(used, kMaxWordBits);
    format.first = input.ConsumeIntegralInRange(0, format.word_bits - used);
  }
  format.gray = input.ConsumeBool();
  format.joint = input.ConsumeBool();
  format.after = input.PickValueInArray({AfterWord::kZeros, AfterWord::kZeroThenWord, AfterWord::kWord});
  format.trailing_checked = input.ConsumeBool();
  if (format.after != AfterWord::kZeros) format.words = input.ConsumeIntegralInRange(1, kMaxWords);
  format.parity = input.PickValueInArray({ParityRule::kNone, ParityRule::kEven, ParityRule::kOdd});
  format.ones_are_position = input.ConsumeBool();
  return format;
}

// Every sample of a place, and every zero, of what was accepted.
void CheckAccepted(Bytes bytes, std::size_t bit_count, const Format& format, const Word& word) {
  SimulatedWord encoder;
  encoder.length = format.word_bits;
  encoder.position_at = format.first;
  encoder.turn_bits = format.turn_bits;
  encoder.bits = format.bits;
  encoder.gray = format.gray;
  encoder.one_gray_code = format.joint;
  const Levels made = encoder.Make(word.turns, word.counts, 0);
  const auto used = static_cast<std::size_t>(format.turn_bits + format.bits);
  const auto first = static_cast<std::size_t>(format.first);
  const auto length = static_cast<std::size_t>(format.word_bits);
  const std::size_t step = length + (format.after == AfterWord::kZeroThenWord ? 1 : 0);
  Require(BitAt(bytes, 0) && bit_count <= bytes.size() * 8);
  for (std::size_t copy = 0; copy < static_cast<std::size_t>(format.words); ++copy) {
    for (std::size_t place = first; place < first + used; ++place) {
      Require(BitAt(bytes, 1 + copy * step + place) == made[place]);
    }
  }
  for (std::size_t i = 1 + length; format.trailing_checked && i < bit_count; ++i) {
    const std::size_t place = (i - 1) % step;
    const bool zero = format.after == AfterWord::kZeros || place == length;
    Require(BitAt(bytes, i) == (zero ? false : BitAt(bytes, 1 + place)));
  }
  for (std::size_t place = 0; place < length; ++place) {
    Require((format.zeros & PlaceMask(format, static_cast<int>(place), 1)) == 0 || !BitAt(bytes, 1 + place));
  }
}

}  // namespace
}  // namespace axlecast::ssi

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast::ssi;
  FuzzedDataProvider input(data, size);
  const Format format = AnyFormat(input);
  Require(TransferSize(format) <= kMaxTransfer);
  const auto missing = input.ConsumeIntegralInRange<std::size_t>(0, 8);
  const auto bytes = input.ConsumeRemainingBytes<std::uint8_t>();
  const std::size_t bit_count = bytes.size() * 8 - std::min(missing, bytes.size() * 8);
  const Word word = ParseTransfer(bytes, bit_count, format);
  if (word.error == WordError::kNone) CheckAccepted(bytes, bit_count, format, word);
  static_cast<void>(WordErrorName(word.error));
  return 0;
}
