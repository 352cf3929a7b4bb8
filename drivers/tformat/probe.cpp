#include "drivers/tformat/family.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/command/commands.h"
#include "core/device/operation.h"
#include "drivers/kit/asking_probe.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {
namespace {

constexpr MonoNs kPatience = 30 * kMillisecond;  // beyond the 16 ms of an adapter that nobody has set up
constexpr MonoNs kQuiet = 20 * kMillisecond;     // a late reply is over by then
constexpr std::int64_t kBaud = 2'500'000;        // spec 6.1
constexpr Format kAnyModel = {.single_turn_bits = 24, .multi_turn_bits = 24};

// ID 3 first: it ends what a dead process may have left unfinished (README.md, "Start").
DataId IdOf(int question) { return question % 2 == 0 ? DataId::kAll : DataId::kEncoderId; }

const Model* ModelOf(std::uint8_t encoder_id) {
  const auto models = Models();
  const auto found = std::find_if(models.begin(), models.end(),
                                  [=](const Model& model) { return model.encoder_id == encoder_id; });
  return found == models.end() ? nullptr : &*found;
}

// Looks for the one encoder on its line by readouts alone, data ID 3 and 2 in turn: they begin no reset sequence, and
// end one that somebody has left unfinished.
class TFormatProbe final : public AskingProbe {
 public:
  [[nodiscard]] std::vector<ProbeHit> Findings() const override {
    if (!encoder_id_) return {};
    const Model* model = ModelOf(*encoder_id_);
    const bool fits = model == nullptr || positions_ >> model->format.single_turn_bits == 0;
    const bool sound = answered_ >= 3 && answered_ > refused_ && fits;
    ProbeHit finding;
    finding.confidence = sound ? Confidence::kSure : answered_ >= 2 ? Confidence::kLikely : Confidence::kPossible;
    finding.device = Text("T-format encoder, ENID 0x%02x", *encoder_id_);
    finding.reason =
        Text("%d of %d readouts came back with control field, CRC and this ENID right", answered_, asked_);
    if (model != nullptr && fits) {
      finding.keys = {{"model", std::string(model->name)}};
      finding.reason += "; the ENID is that of " + std::string(model->name);
      return {finding};
    }
    finding.keys = {{"model", std::string(kCustomModel)},
                    {"bits", "24"},
                    {"turn_bits", "16"},
                    {"enid", Text("0x%02x", *encoder_id_)}};
    finding.reason += Text("; no model of this ENID is known; its position took %d bits so far",
                           static_cast<int>(std::bit_width(positions_)));
    finding.check = "bits and turn_bits: the line does not show them; see the encoder's label";
    return {finding};
  }
  [[nodiscard]] double Progress() const override {
    return static_cast<double>(asked_) / (answered_ == 0 && refused_ == 0 ? kVain : kQuestions);
  }

 protected:
  [[nodiscard]] std::optional<Question> Ask() const override {
    if (asked_ >= kQuestions || (answered_ == 0 && asked_ >= kVain)) return std::nullopt;
    return Question{.exchange = tformat::Ask(IdOf(asked_), kPatience), .quiet = kQuiet};
  }
  void Evaluate(const Event& event) override {
    ++asked_;
    if (event.bytes.empty()) return;
    const Reply reply = ParseReply(event.request, event.bytes, kAnyModel);
    const bool same = !encoder_id_ || encoder_id_ == reply.encoder_id;
    if (reply.error != ReplyError::kNone || !reply.encoder_id || !same) {
      ++refused_;
      return;
    }
    encoder_id_ = reply.encoder_id;
    positions_ |= reply.single_turn.value_or(0);
    ++answered_;
  }

 private:
  static constexpr int kQuestions = 8;
  static constexpr int kVain = 4;  // of them without any answer: nobody is there

  int asked_ = 0;
  int answered_ = 0;  // without an error, with the same ENID
  int refused_ = 0;   // damaged, or with another ENID than before
  std::optional<std::uint8_t> encoder_id_;
  std::uint32_t positions_ = 0;  // every bit of ABS that was ever set
};

}  // namespace
}  // namespace axlecast::tformat

namespace axlecast {

std::vector<ProbeTrial> tformat_probe(const ProbeScope& scope) {
  std::vector<ProbeTrial> trials;
  for (const std::int64_t baud : scope.RatesOf({tformat::kBaud})) {
    ProbeTrial trial;
    trial.what = "T-format, 2.5 Mbit/s: data ID 3 and 2";
    trial.asks = true;
    trial.line = {.baud = baud};
    trial.longest = 4 * (tformat::kPatience + tformat::kQuiet) +
                    kLatestProbeReply;  // the second ID 3 waits for the reply to the first
    trial.make = [](MonoNs) { return std::make_unique<tformat::TFormatProbe>(); };
    trials.push_back(std::move(trial));
  }
  return trials;
}

}  // namespace axlecast
