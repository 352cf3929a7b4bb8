// Any answers, strays and silences.
#include "drivers/ssi/family.h"

#include "tests/fuzz/probe_fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  axlecast::ProbeFuzz fuzz(axlecast::ssi_probe({}), input);
  fuzz.Run([](axlecast::Bytes request) {
    return std::all_of(request.begin(), request.end(), [](std::uint8_t byte) { return byte == 0; });
  });
  return 0;
}
