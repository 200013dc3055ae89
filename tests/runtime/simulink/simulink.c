/* Calls an S-function as Simulink does: program LIBRARY GUID RESOURCES INPUT OUTPUT STEP STEPS VALUE prints the output. */
int main(int count, char **given) {
  mxArray parameter[PARAMETERS];
  real_T input = atof(given[8]);
  SimStruct S = { .given = PARAMETERS, .input = &input, .parameter = parameter };
  for (int k = 0; k < PARAMETERS; k++) parameter[k] = (mxArray){ given[1 + k], atof(given[1 + k]) };
  mdlInitializeSizes(&S);
  mdlInitializeSampleTimes(&S);
  mdlStart(&S);
  for (int k = 0; !S.error && k < atoi(given[7]); k++) {
    S.time = k * S.sample;
    mdlOutputs(&S, 0);
    mdlUpdate(&S, 0);
  }
  if (!S.error) mdlOutputs(&S, 0);
  mdlTerminate(&S);
  return S.error ? (fprintf(stderr, "%s\n", S.error), 1) : printf("%.17g\n", S.output) < 0;
}
