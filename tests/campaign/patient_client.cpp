// A program of the client library that must not end: gives one reading command after the other until it is terminated, and
// prints a line for each. tests/e2e/test_datagrams.py runs it while hostile datagrams come.
#include <cstdio>
#include <string>

#include <axlecast/command_client.h>
#include <axlecast/machine_settings.h>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: patient_client CONFIG DEVICE\n");
    return 2;
  }
  const auto settings = axlecast::SettingsOfMachine(argv[1], "");
  if (!settings) {
    std::fprintf(stderr, "%s\n", settings.error().text.c_str());
    return 1;
  }
  axlecast::CommandClient client(*settings);
  while (client.state()) {
    axlecast::CommandRequest request;
    request.device = argv[2];
    request.operation = "eeprom_read";
    request.arguments = {{"address", "10"}};
    request.valid_ms = 5'000;
    const axlecast::CommandResult result = client.Await(client.Send(request), 10'000);
    const bool done = result.outcome() == axlecast::CommandOutcome::kDone;
    std::printf("%s\n", done ? "done" : (result.problem + result.status.text).c_str());
    std::fflush(stdout);
  }
  std::fprintf(stderr, "%s\n", axlecast::ErrorText(client.state()).c_str());
  return 1;
}
