// A message, encoded and decoded.
#include <mantle/status_t.hpp>
#include <vector>

int main() {
  mantle::status_t sent{}, received{};
  sent.utime = 42;
  sent.text = "here";
  std::vector<unsigned char> bytes(sent.getEncodedSize());
  const int size = static_cast<int>(bytes.size());
  if (sent.encode(bytes.data(), 0, size) != size) return 1;
  if (received.decode(bytes.data(), 0, size) != size) return 2;
  return received.utime == 42 && received.text == "here" ? 0 : 3;
}
