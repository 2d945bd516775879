namespace mantle::firmware_sim {}
