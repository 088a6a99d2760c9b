// In place of alpha where a pixel has no fragment: nothing reached it; something reached it, but contributed nothing; something
// reached it, but its stencil test failed.
const float NOT_REACHED = -1.0, REACHED = -2.0, REACHED_IN_VAIN = -3.0;
