#include "bridge/access/admission.h"

#include "bridge/access/authority_fixture.h"

// Arbitrary bytes as a command, as a body under a good signature, and as damage to a good command: nobody is taken
// for the owner of a key.
namespace axlecast {
namespace {

class Fuzz {
 public:
  Fuzz() { keys_.config.allow_unsigned = true; }

  void Run(Bytes data) {
    Hear(data);
    command_t envelope = good_;
    envelope.body.assign(data.begin(), data.end());
    Hear(envelope);
    Damage(data);
  }

 private:
  void Hear(Bytes message) {
    if (const auto envelope = DecodeMessage<command_t>(message)) Hear(*envelope);
  }
  void Hear(const command_t& envelope) {
    const auto body = DecodeMessage<command_body_t>(envelope.body);
    if (!body) return;
    const auto answer = authority_.Identify(envelope, *body);
    const Caller* caller = answer ? &*answer : nullptr;
    if (caller != nullptr && (caller->grant != nullptr || body->key_id != 0)) __builtin_trap();
    if (caller != nullptr) return;
    if (answer.error().text.size() > 200) __builtin_trap();
  }
  void Damage(Bytes data) {
    command_t envelope = good_;
    for (std::size_t i = 0; i + 1 < data.size(); i += 2) {
      if (data[i] < sizeof envelope.sig) envelope.sig[data[i]] ^= data[i + 1];
      if (data[i] >= sizeof envelope.sig) envelope.body[data[i] % envelope.body.size()] ^= data[i + 1];
    }
    const bool same_signature = std::equal(std::begin(good_.sig), std::end(good_.sig), std::begin(envelope.sig));
    if (!same_signature || envelope.body != good_.body) Hear(envelope);
  }

  AccessKeys keys_;
  const command_t good_ = keys_.Signed("service");
  const Authority authority_{keys_.config};
};

}  // namespace
}  // namespace axlecast

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static axlecast::Fuzz fuzz;
  fuzz.Run({data, size});
  return 0;
}
